#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cstring>
#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/files.h"
#include "pipeline/model_io/mesh_reader.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// A tetrahedron of 60 mm whose four faces lie in four quarters of a four-coloured atlas.
TexturedMesh tetrahedron() {
  TexturedMesh model;
  model.mesh.vertices = {{0, 0, 0}, {60, 0, 0}, {0, 60, 0}, {0, 0, 60}};
  model.mesh.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  model.mesh.colour = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {10, 20, 30}};
  model.mesh.views = {3, 0, 8, 1};
  model.mesh.sigma = {0.01F, std::numeric_limits<float>::quiet_NaN(), 0.02F, 0.03F};
  model.atlas = cv::Mat3b(64, 64);
  const std::array<cv::Vec3b, 4> colours = {cv::Vec3b(0, 0, 220), {0, 220, 0}, {220, 0, 0}, {200, 200, 200}};
  for (int f = 0; f < 4; ++f) {
    const cv::Rect quarter(f % 2 * 32, f / 2 * 32, 32, 32);
    model.atlas(quarter).setTo(colours[static_cast<std::size_t>(f)]);
    const Eigen::Vector2f corner(static_cast<float>(quarter.x) / 64.0F, static_cast<float>(quarter.y) / 64.0F);
    model.corner_uv.push_back({corner + Eigen::Vector2f(0.1F, 0.1F), corner + Eigen::Vector2f(0.4F, 0.1F),
                               corner + Eigen::Vector2f(0.1F, 0.4F)});
  }
  return model;
}

class ModelFilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    room_ = fs::temp_directory_path() / fmt::format("scanrig_model_test_{}", ::getpid());
    fs::remove_all(room_);
    fs::create_directories(room_);
  }
  void TearDown() override { fs::remove_all(room_); }

  [[nodiscard]] std::set<std::string> names_in(const fs::path& folder) const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
    return names;
  }
  fs::path room_;
};

TEST_F(ModelFilesTest, aModelIsWrittenInEveryFormatAndNothingElseIsLeft) {
  const auto files = write_model_files(tetrahedron(), "{}", room_ / "model");
  ASSERT_TRUE(files) << files.error().message;
  const std::set<std::string> wanted = {"model.glb", "view.glb",  "model.ply", "model.stl",
                                        "model.obj", "model.mtl", "model.png", "report.json"};
  EXPECT_EQ(names_in(room_ / "model"), wanted);
  EXPECT_EQ(std::set<std::string>(files->names.begin(), files->names.end()), wanted);
  EXPECT_EQ(names_in(room_), std::set<std::string>{"model"});
}

TEST_F(ModelFilesTest, anOlderModelIsReplacedAsAWhole) {
  fs::create_directories(room_ / "model");
  std::ofstream(room_ / "model" / "stale.txt") << "old";
  ASSERT_TRUE(write_model_files(tetrahedron(), "", room_ / "model"));
  EXPECT_FALSE(fs::exists(room_ / "model" / "stale.txt"));
  EXPECT_TRUE(fs::exists(room_ / "model" / "model.glb"));
  EXPECT_EQ(names_in(room_), std::set<std::string>{"model"});
}

TEST_F(ModelFilesTest, aModelWithoutATextureHasNoObj) {
  TexturedMesh model = tetrahedron();
  model.atlas.release();
  model.corner_uv.clear();
  ASSERT_TRUE(write_model_files(model, "", room_ / "model"));
  EXPECT_EQ(names_in(room_ / "model"), (std::set<std::string>{"model.glb", "view.glb", "model.ply", "model.stl"}));
}

TEST_F(ModelFilesTest, theOldModelStaysWhenWritingFails) {
  std::ofstream(room_ / "file") << "not a folder";
  const auto files = write_model_files(tetrahedron(), "", room_ / "file" / "model");
  ASSERT_FALSE(files);
  EXPECT_EQ(files.error().code, ErrorCode::io);
  EXPECT_EQ(names_in(room_), std::set<std::string>{"file"});
}

TEST_F(ModelFilesTest, aModelWithoutFacesIsNotWritten) {
  const auto files = write_model_files({}, "", room_ / "model");
  ASSERT_FALSE(files);
  EXPECT_EQ(files.error().code, ErrorCode::degenerate);
  EXPECT_TRUE(names_in(room_).empty());
}

tinygltf::Model opened(const Result<std::string>& bytes) {
  tinygltf::Model gltf;
  if (!bytes) {
    ADD_FAILURE() << bytes.error().message;
    return gltf;
  }
  std::string error, warning;
  EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(&gltf, &error, &warning,
                                                        reinterpret_cast<const unsigned char*>(bytes->data()),
                                                        static_cast<unsigned>(bytes->size())))
      << error;
  EXPECT_EQ(warning, "");
  return gltf;
}

/// The values of one attribute of the only primitive, `per_vertex` of them each.
template <class T>
std::vector<T> attribute(const tinygltf::Model& gltf, const std::string& name, std::size_t per_vertex) {
  const auto& accessor = gltf.accessors.at(gltf.meshes.at(0).primitives.at(0).attributes.at(name));
  const auto& view = gltf.bufferViews.at(accessor.bufferView);
  const std::size_t stride = view.byteStride == 0 ? per_vertex * sizeof(T) : view.byteStride;
  std::vector<T> values(per_vertex * accessor.count);
  for (std::size_t i = 0; i < accessor.count; ++i) {
    std::memcpy(&values[per_vertex * i],
                gltf.buffers.at(0).data.data() + view.byteOffset + accessor.byteOffset + stride * i,
                per_vertex * sizeof(T));
  }
  return values;
}

TEST_F(ModelFilesTest, theGlbOpensElsewhereInMetresWithItsTexture) {
  const auto gltf = opened(encode_glb(tetrahedron()));
  ASSERT_FALSE(gltf.meshes.empty());
  EXPECT_EQ(gltf.asset.generator, "scanrig");
  const auto& primitive = gltf.meshes.at(0).primitives.at(0);
  const auto& positions = gltf.accessors.at(primitive.attributes.at("POSITION"));
  EXPECT_EQ(positions.count, 12u) << "each face has its own place in the atlas, so no vertex can be shared";
  EXPECT_THAT(positions.maxValues, ::testing::Each(::testing::DoubleNear(0.06, 1e-8)));
  EXPECT_THAT(positions.minValues, ::testing::Each(0.0));
  EXPECT_EQ(gltf.accessors.at(primitive.indices).count, 12u);
  const auto& material = gltf.materials.at(0).pbrMetallicRoughness;
  EXPECT_EQ(material.metallicFactor, 0.0);
  EXPECT_EQ(material.roughnessFactor, 1.0);
  ASSERT_EQ(material.baseColorTexture.index, 0);

  // The colour under the middle of face 0's coordinates is that of its quarter.
  const auto first = attribute<float>(gltf, "TEXCOORD_0", 2);
  EXPECT_NEAR(first[0], 0.1, 1e-6);
  EXPECT_NEAR(first[1], 0.1, 1e-6);
  const auto& image = gltf.images.at(0);
  ASSERT_EQ(image.width, 64);
  const std::size_t at = (static_cast<std::size_t>(first[1] * 64) * 64 + static_cast<std::size_t>(first[0] * 64)) *
                         static_cast<std::size_t>(image.component);
  EXPECT_NEAR(image.image[at], 220, 4) << "red, first in RGB";
  EXPECT_NEAR(image.image[at + 2], 0, 4);
}

TEST_F(ModelFilesTest, theGlbForABrowserNamesTheOtherRest) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  const auto gltf = opened(encode_view_glb(tetrahedron(), {.other_rest = quarter}));
  ASSERT_FALSE(gltf.nodes.empty());
  const auto& rest = gltf.nodes[0].extras.Get("other_rest");
  ASSERT_EQ(rest.ArrayLen(), 4u);
  EXPECT_NEAR(rest.Get(2).GetNumberAsDouble(), std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(rest.Get(3).GetNumberAsDouble(), std::sqrt(0.5), 1e-9);
  EXPECT_FALSE(opened(encode_view_glb(tetrahedron())).nodes.at(0).extras.Has("other_rest"));
}

TEST_F(ModelFilesTest, theGlbForABrowserKeepsPlacesViewsAndSigma) {
  const TexturedMesh model = tetrahedron();
  const auto gltf = opened(encode_view_glb(model));
  ASSERT_FALSE(gltf.meshes.empty());
  EXPECT_THAT(gltf.extensionsRequired, testing::ElementsAre("KHR_mesh_quantization"));
  const auto& node = gltf.nodes.at(0);
  const auto steps = attribute<std::uint16_t>(gltf, "POSITION", 3);
  const auto views = attribute<std::uint8_t>(gltf, "_VIEWS", 1);
  const auto sigma = attribute<std::uint16_t>(gltf, "_SIGMA", 1);
  const auto uv = attribute<std::uint16_t>(gltf, "TEXCOORD_0", 2);
  ASSERT_EQ(views.size(), 12u);
  std::set<std::size_t> seen;
  for (std::size_t i = 0; i < views.size(); ++i) {
    Eigen::Vector3f place;
    for (std::size_t k = 0; k < 3; ++k)
      place[static_cast<int>(k)] =
          static_cast<float>(1000.0 * (node.translation[k] + node.scale[k] * steps[3 * i + k]));
    const auto vertex =
        std::ranges::find_if(model.mesh.vertices, [&](const auto& v) { return (v - place).norm() < 1e-3F; });
    ASSERT_NE(vertex, model.mesh.vertices.end()) << place.transpose();
    const auto v = static_cast<std::size_t>(vertex - model.mesh.vertices.begin());
    seen.insert(v);
    EXPECT_EQ(views[i], model.mesh.views[v]);
    EXPECT_EQ(sigma[i], std::isnan(model.mesh.sigma[v]) ? 65535 : std::lround(1e5F * model.mesh.sigma[v]));
  }
  EXPECT_EQ(seen.size(), 4u);
  EXPECT_NEAR(uv[0] / 65535.0, model.corner_uv[0][0].x(), 1e-4);
}

/// A square of 60 mm in 2 n^2 faces, on one chart.
TexturedMesh sheet(std::uint32_t n) {
  TexturedMesh model;
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n; ++j) {
      model.mesh.vertices.emplace_back(60.0F * static_cast<float>(i) / static_cast<float>(n),
                                       60.0F * static_cast<float>(j) / static_cast<float>(n), 0.0F);
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return i * (n + 1) + j; };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      model.mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      model.mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  for (const auto& face : model.mesh.faces) {
    std::array<Eigen::Vector2f, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) uv[k] = model.mesh.vertices[face[k]].head<2>() / 60.0F;
    model.corner_uv.push_back(uv);
  }
  model.atlas = cv::Mat3b(128, 128, cv::Vec3b(10, 200, 30));
  return model;
}

TEST_F(ModelFilesTest, theGlbForABrowserHasFewerFacesAndASmallerTexture) {
  const auto gltf = opened(encode_view_glb(sheet(40), {.max_faces = 500, .texture_px = 64}));
  ASSERT_FALSE(gltf.meshes.empty());
  const auto& indices = gltf.accessors.at(gltf.meshes.at(0).primitives.at(0).indices);
  EXPECT_LE(indices.count, 1500u);
  EXPECT_GE(indices.count, 6u);
  EXPECT_EQ(gltf.images.at(0).width, 64);
  const auto& positions = gltf.accessors.at(gltf.meshes.at(0).primitives.at(0).attributes.at("POSITION"));
  EXPECT_LT(positions.count, 1681u) << "vertices that no face uses are left out";
  EXPECT_EQ(positions.maxValues.at(0), 65535.0);
}

TEST_F(ModelFilesTest, aGlbForABrowserWantsFaces) {
  const auto bytes = encode_view_glb({});
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::degenerate);
}

TEST_F(ModelFilesTest, thePlyKeepsEveryVertexWithItsMeasurements) {
  const TexturedMesh model = tetrahedron();
  const std::string bytes = encode_ply(model.mesh);
  EXPECT_THAT(bytes, HasSubstr("comment units mm"));
  EXPECT_THAT(bytes, HasSubstr("comment up axis +Y"));
  const auto mesh = parse_ply(bytes, "model.ply");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices, model.mesh.vertices);
  EXPECT_EQ(mesh->faces, model.mesh.faces);
  EXPECT_EQ(mesh->colour, model.mesh.colour);
  EXPECT_EQ(mesh->views, model.mesh.views);
  EXPECT_FLOAT_EQ(mesh->sigma[3], 0.03F);
  EXPECT_TRUE(std::isnan(mesh->sigma[1]));
  EXPECT_NEAR(mesh->normals[0].norm(), 1.0F, 1e-6F);
  EXPECT_LT(mesh->normals[0].x(), 0.0F) << "outwards";
}

TEST_F(ModelFilesTest, theObjReadsBackAndItsTextureStartsAtTheBottom) {
  const TexturedMesh model = tetrahedron();
  const std::string text = encode_obj(model, "model.mtl");
  EXPECT_THAT(text, HasSubstr("mtllib model.mtl"));
  EXPECT_THAT(text, HasSubstr("units mm"));
  EXPECT_THAT(text, HasSubstr("vt 0.1000000 0.9000000"));
  const auto mesh = parse_obj(text, "model.obj");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->vertices, model.mesh.vertices);
  EXPECT_EQ(mesh->faces, model.mesh.faces);
  EXPECT_THAT(encode_mtl("model.png"), HasSubstr("map_Kd model.png"));
}

TEST_F(ModelFilesTest, anObjFaceNamesItsVerticesAndItsTextureCoordinates) {
  TexturedMesh model = tetrahedron();
  model.mesh.vertices[1].x() = 59.1234567F;
  const std::string text = encode_obj(model, "model.mtl");
  EXPECT_THAT(text, HasSubstr("v 59.12346 0 0\n"));
  // Three coordinates of their own for each of the four faces: the second face has the fourth to the sixth.
  EXPECT_THAT(text, HasSubstr("f 1/1 3/2 2/3\nf 1/4 2/5 4/6\n"));
}

TEST_F(ModelFilesTest, theStlHasFiftyBytesPerFaceAndNamesItsUnit) {
  const std::string bytes = encode_stl(tetrahedron().mesh);
  ASSERT_EQ(bytes.size(), 84u + 4u * 50u);
  EXPECT_FALSE(bytes.starts_with("solid"));
  EXPECT_THAT(bytes.substr(0, 80), HasSubstr("units mm"));
  std::array<float, 6> facet{};  // normal and first corner of the last face
  std::memcpy(facet.data(), bytes.data() + 84 + 3 * 50, sizeof facet);
  EXPECT_NEAR(facet[0], 1.0 / std::sqrt(3.0), 1e-6);
  EXPECT_EQ(facet[3], 60.0F);
}

}  // namespace
}  // namespace scanrig
