#include "pipeline/deviation/references.h"

#include <gmock/gmock.h>

#include <cstring>
#include <fstream>

#include "core/files.h"
#include "pipeline/deviation/model_deviation.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/model_io/mesh_reader.h"
#include "pipeline/model_io/model_files.h"
#include "tests/own_folder.h"
#include "tests/unit/pipeline/deviation/part.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class References : public ::testing::Test {
 protected:
  References() { fs::create_directories(job() / "model"); }
  ~References() override { fs::remove_all(root_); }
  [[nodiscard]] fs::path job() const { return root_ / "job1"; }
  fs::path file(const std::string& name, const std::string& bytes) const {
    EXPECT_TRUE(write_file_atomically(root_ / name, bytes));
    return root_ / name;
  }
  [[nodiscard]] DeviationTask task() const { return {job(), root_, "bracket"}; }
  void write_model(const Mesh& mesh) const {
    file("job1/model/view.glb", *encode_view_glb({.mesh = mesh, .corner_uv = {}, .atlas = {}}));
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    const auto kept = list_references(root_);
    for (const auto& one : *kept) all.push_back(one.name);
    return all;
  }

  const fs::path root_ = own_folder();
};

TEST_F(References, everyFormatBecomesTheSameSolid) {
  const Mesh part = deviation_part::part_mesh(2.0);
  Mesh inside_out = part;
  for (auto& face : inside_out.faces) std::swap(face[0], face[1]);
  const auto volume = solid_properties(part)->volume_mm3;
  const TexturedMesh plain{.mesh = part, .corner_uv = {}, .atlas = {}};
  const std::vector<fs::path> files{file("a.stl", encode_stl(part)), file("b.STL", encode_stl(inside_out)),
                                    file("c.ply", encode_ply(part)), file("d.obj", encode_obj(plain, "none.mtl")),
                                    file("e.glb", *encode_glb(plain))};
  for (const auto& one : files) {
    const auto added = add_reference(root_, one.stem(), one);
    ASSERT_TRUE(added) << added.error().message;
    const auto kept = parse_ply(*read_reference(root_, one.stem()), "kept");
    ASSERT_TRUE(kept) << one;
    EXPECT_EQ(kept->vertices.size(), part.vertices.size()) << one << ": vertices of triangles are joined";
    const auto solid = solid_properties(*kept);
    ASSERT_TRUE(solid) << one << ": closed, and outwards";
    EXPECT_NEAR(solid->volume_mm3, volume, 1e-4 * volume) << one << ": in mm";
  }
  EXPECT_THAT(names(), ElementsAre("a", "b", "c", "d", "e"));
  EXPECT_TRUE(remove_reference(root_, "c"));
  EXPECT_THAT(names(), ElementsAre("a", "b", "d", "e"));
}

TEST_F(References, whatIsNoNameOrNoMeshIsRefused) {
  const auto good = file("a.stl", encode_stl(deviation_part::part_mesh(4.0)));
  for (const std::string name : {"", ".hidden", "a/b", "../a", "a b", "\xC3\xA4", "a\nb"}) {
    EXPECT_EQ(add_reference(root_, name, good).error().code, ErrorCode::invalid_input) << name;
    EXPECT_EQ(read_reference(root_, name).error().code, ErrorCode::not_found) << name;
    EXPECT_EQ(remove_reference(root_, name).error().code, ErrorCode::not_found) << name;
  }
  EXPECT_EQ(add_reference(root_, std::string(65, 'a'), good).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(add_reference(root_, "a", root_ / "none.stl").error().code, ErrorCode::not_found);
  EXPECT_THAT(add_reference(root_, "a", file("b.step", "ISO-10303")).error().message, HasSubstr("neither .stl"));
  EXPECT_THAT(add_reference(root_, "a", file("line.obj", "v 0 0 0\nv 1 0 0\nf 1 2 1\n")).error().message,
              HasSubstr("no area"));
  EXPECT_TRUE(names().empty());
}

TEST_F(References, aModelIsComparedOnceAndAgainWhenItOrTheReferenceChanges) {
  const Mesh part = deviation_part::part_mesh(1.5);
  ASSERT_TRUE(add_reference(root_, "bracket", file("a.stl", encode_stl(part))));
  EXPECT_EQ(find_deviation(task()).error().code, ErrorCode::not_found) << "no model";
  Mesh model = deviation_part::moved_mesh(part, deviation_part::some_motion(20.0));
  model.views.assign(model.vertices.size(), 2);
  model.views[7] = 0;
  write_model(model);
  EXPECT_FALSE(*find_deviation(task())) << "not yet";
  const auto made = compute_deviation(task());
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_LT(made->p95_mm, 0.02);
  EXPECT_EQ(made->model_file, "model/view.glb");
  EXPECT_LT(made->known_share, 1.0);
  const auto values = read_file(job() / made->values_file);
  ASSERT_TRUE(values);
  const auto seen = parse_glb(*read_file(job() / made->model_file), "view.glb");
  ASSERT_EQ(values->size(), 2 * seen->vertices.size()) << "one per vertex of the file";
  std::size_t unknown = 0;
  for (std::size_t v = 0; v < seen->vertices.size(); ++v) {
    std::int16_t um = 0;
    std::memcpy(&um, values->data() + 2 * v, 2);
    if (um == kUnknownUm) ++unknown;
    EXPECT_TRUE(seen->views[v] > 0 || um == kUnknownUm) << "not measured";
  }
  EXPECT_LT(unknown, seen->vertices.size() / 1000) << "but at sharp inner edges";
  const auto again = find_deviation(task());
  ASSERT_TRUE(*again);
  EXPECT_EQ((*again)->values_file, made->values_file);
  EXPECT_EQ((*again)->p95_mm, made->p95_mm);
  ASSERT_TRUE(write_file_atomically(job() / (made->values_file.substr(0, made->values_file.size() - 5) + ".json"),
                                    std::string_view("{damaged")));
  EXPECT_FALSE(*find_deviation(task())) << "a damaged record is made again";
  write_model(part);
  EXPECT_FALSE(*find_deviation(task())) << "another model";
}

TEST_F(References, anotherPartIsRefusedAndLeavesNothing) {
  ASSERT_TRUE(add_reference(root_, "bracket", file("b.stl", encode_stl(testing::box_mesh({0, 0, 0}, {60, 50, 40})))));
  Mesh model = deviation_part::part_mesh(1.5);
  model.views.assign(model.vertices.size(), 1);
  write_model(model);
  const auto made = compute_deviation(task());
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::no_overlap);
  EXPECT_FALSE(fs::exists(job() / "model/deviation"));
}

}  // namespace
}  // namespace scanrig
