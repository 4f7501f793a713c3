#include "pipeline/model_io/mesh_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <random>

#include "pipeline/model_io/model_files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kSquare =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\nproperty double y\n"
    "property double z\nproperty float red\nproperty float green\nproperty float blue\nproperty int odd\n"
    "element face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\nelement edge 1\nproperty int a\n"
    "end_header\n0 0 0 1 0 0 7\n1 0 0 0 1 0 7\n1 1 0 0 0 1 7\n0 1 0 0.5 2 -1 7\n9 4 0 1 2 3\n5\n";

fs::path shared_data() {
  const char* place = std::getenv("SCANRIG_SHARED_DATA");
  return place != nullptr ? fs::path(place) : fs::path(SCANRIG_SOURCE_DIR) / "../shared/data";
}

std::string message_of(const Result<Mesh>& mesh) {
  EXPECT_FALSE(mesh);
  if (mesh) return "";
  EXPECT_EQ(mesh.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(mesh.error().message, HasSubstr("a.ply"));
  return mesh.error().message;
}

std::string with(std::string text, const std::string& old, const std::string& replacement) {
  const auto at = text.find(old);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, old.size(), replacement);
}

TEST(MeshReaderTest, aForeignAsciiPlyWithPolygonsIsRead) {
  const auto mesh = parse_ply(kSquare, "a.ply");
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->vertices.size(), 4u);
  EXPECT_EQ(mesh->vertices[2], Eigen::Vector3f(1, 1, 0));
  EXPECT_EQ(mesh->faces, (std::vector<Mesh::Face>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(mesh->colour[0], (std::array<std::uint8_t, 3>{255, 0, 0}));
  EXPECT_EQ(mesh->colour[3], (std::array<std::uint8_t, 3>{127, 255, 0})) << "clamped";
  EXPECT_TRUE(mesh->normals.empty());
  EXPECT_TRUE(mesh->views.empty());
}

TEST(MeshReaderTest, aPlyOfTheOtherByteOrderIsRead) {
  std::string file =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](std::uint32_t bits) {
    for (int shift = 24; shift >= 0; shift -= 8) file += static_cast<char>(bits >> shift);
  };
  for (const float v : {0.0F, 0.0F, 0.0F, 1.5F, 0.0F, 0.0F, 0.0F, -2.0F, 0.0F}) put(std::bit_cast<std::uint32_t>(v));
  file += '\3';
  for (const std::uint32_t index : {0U, 1U, 2U}) put(index);
  const auto mesh = parse_ply(file, "a.ply");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices[1].x(), 1.5F);
  EXPECT_EQ(mesh->vertices[2].y(), -2.0F);
}

TEST(MeshReaderTest, anUnusablePlyIsRefusedByNameAndReason) {
  EXPECT_THAT(message_of(parse_ply("solid cube", "a.ply")), HasSubstr("not a PLY"));
  EXPECT_THAT(message_of(parse_ply("ply\nformat ascii 1.0\n", "a.ply")), HasSubstr("no end"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "ascii", "utf8"), "a.ply")), HasSubstr("utf8"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "double x", "quad x"), "a.ply")), HasSubstr("quad"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "double z", "double w"), "a.ply")), HasSubstr("no x, y, z"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "element edge", "element vertex"), "a.ply")), HasSubstr("twice"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "0 1 0 0.5", "0 nan 0 0.5"), "a.ply")), HasSubstr("vertex 3"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "0 1 2 3\n", "0 1 2 4\n"), "a.ply")), HasSubstr("missing vertex"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "9 4 0 1 2 3", "9 2 0 1"), "a.ply")), HasSubstr("2 corners"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "element face 1\n", "element face 0\n"), "a.ply")),
              HasSubstr("no faces"));
  EXPECT_THAT(message_of(parse_ply(with(kSquare, "vertex 4", "vertex 4000000000000"), "a.ply")),
              HasSubstr("cut short"));
}

TEST(MeshReaderTest, aPlyCutShortAnywhereIsRefused) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.faces = {{0, 1, 2}};
  const std::string whole = encode_ply(mesh);
  ASSERT_TRUE(parse_ply(whole, "a.ply"));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_ply(std::string_view(whole).substr(0, size), "a.ply")) << size << " bytes";
  }
}

TEST(MeshReaderTest, garbageNeverCrashesAReader) {
  std::mt19937 random(7);
  for (const std::string& good : {kSquare, std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/2 -1/3\n")}) {
    for (int round = 0; round < 20000; ++round) {
      std::string bad = good;
      for (int k = 0; k < 4; ++k) bad[random() % bad.size()] = static_cast<char>(random());
      (void)parse_ply(bad, "a.ply");
      (void)parse_obj(bad, "a.obj");
    }
  }
}

TEST(MeshReaderTest, anObjWithTextureIndicesAndCountsFromTheEndIsRead) {
  const auto mesh =
      parse_obj("# a\r\nv 0 0 0\r\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 -1\n", "a.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices.size(), 3u);
  EXPECT_EQ(mesh->faces, (std::vector<Mesh::Face>{{0, 1, 2}}));
}

TEST(MeshReaderTest, anUnusableObjIsRefusedByLine) {
  const auto message = [](std::string_view text) {
    const auto mesh = parse_obj(text, "a.obj");
    EXPECT_FALSE(mesh);
    return mesh ? "" : mesh.error().message;
  };
  EXPECT_THAT(message("v 0 0\nf 1 1 1\n"), HasSubstr("a.obj, line 1"));
  EXPECT_THAT(message("v 0 0 0\nf 1 1 2\n"), HasSubstr("a.obj, line 2"));
  EXPECT_THAT(message("v 0 0 0\nf 1 1 0\n"), HasSubstr("missing vertex"));
  EXPECT_THAT(message("v 0 0 0\nf 1 1 -2\n"), HasSubstr("missing vertex"));
  EXPECT_THAT(message("v 0 0 0\nf 1 1\n"), HasSubstr("2 corners"));
  EXPECT_THAT(message("v 0 0 0\n"), HasSubstr("no faces"));
}

TEST(MeshReaderTest, aMissingFileOrOneOfAnotherKindIsNamed) {
  EXPECT_EQ(read_ply("/nonexistent/a.ply").error().code, ErrorCode::not_found);
  EXPECT_EQ(read_obj("/nonexistent/a.obj").error().code, ErrorCode::not_found);
  EXPECT_EQ(read_mesh("/nonexistent/a.step").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(read_ply("/").error().code, ErrorCode::io);
}

TEST(MeshReaderTest, publishedMeshesAreRead) {
  if (!fs::exists(shared_data() / "meshes")) GTEST_SKIP() << "no shared data";
  const auto igea = read_mesh(shared_data() / "meshes/igea_tri.ply");
  ASSERT_TRUE(igea) << igea.error().message;
  EXPECT_EQ(igea->vertices.size(), 134345u);
  EXPECT_EQ(igea->faces.size(), 268686u);
  const auto dragon = read_mesh(shared_data() / "stanford_dragon/recon/dragon_vrip_res4.obj");
  ASSERT_TRUE(dragon) << dragon.error().message;
  EXPECT_GT(dragon->faces.size(), 10000u);
}

}  // namespace
}  // namespace scanrig
