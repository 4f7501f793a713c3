#include "pipeline/model_io/mesh_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "pipeline/model_io/model_files.h"
#include "tests/shared_data.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kSquare =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\nproperty double y\n"
    "property double z\nproperty float red\nproperty float green\nproperty float blue\nproperty int odd\n"
    "element face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\nelement edge 1\nproperty int a\n"
    "end_header\n0 0 0 1 0 0 7\n1 0 0 0 1 0 7\n1 1 0 0 0 1 7\n0 1 0 0.5 2 -1 7\n9 4 0 1 2 3\n5\n";

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

/// A tetrahedron.
Mesh four_faces() {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 20, 0}, {0, 0, 30}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

TEST(MeshReaderTest, aBinaryStlIsReadWhateverItsHeadSays) {
  std::string file = encode_stl(four_faces());
  file.replace(0, 5, "solid");
  const auto mesh = parse_stl(file, "a.stl");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices.size(), 12u);
  EXPECT_EQ(mesh->vertices[11], Eigen::Vector3f(0, 0, 30));
  EXPECT_EQ(mesh->faces[3], (Mesh::Face{9, 10, 11}));
  for (std::size_t size = 0; size < file.size(); ++size) {
    EXPECT_FALSE(parse_stl(std::string_view(file).substr(0, size), "a.stl")) << size;
  }
  const float bad = std::nanf("");
  std::memcpy(file.data() + 84 + 12, &bad, 4);
  EXPECT_THAT(parse_stl(file, "a.stl").error().message, HasSubstr("triangle 1"));
}

TEST(MeshReaderTest, aTextStlIsReadAndAnUnusableOneRefusedByLine) {
  const std::string good =
      "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e1 0 0\r\n   vertex 0 2.5 0\n"
      "  endloop\n endfacet\nendsolid a b\n";
  const auto mesh = parse_stl(good, "a.stl");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices, (std::vector<Eigen::Vector3f>{{0, 0, 0}, {10, 0, 0}, {0, 2.5F, 0}}));
  EXPECT_EQ(mesh->faces, (std::vector<Mesh::Face>{{0, 1, 2}}));
  const auto message = [](const std::string& text) { return parse_stl(text, "a.stl").error().message; };
  EXPECT_THAT(message(with(good, "vertex 0 0 0\n", "")), HasSubstr("a.stl, line 6: a triangle has 2 corners"));
  EXPECT_THAT(message(with(good, "2.5", "x")), HasSubstr("a.stl, line 6: a vertex that is not a number"));
  EXPECT_THAT(message(good.substr(0, good.find("  endloop"))), HasSubstr("within a triangle"));
  EXPECT_THAT(message("solid empty\nendsolid\n"), HasSubstr("no faces"));
  EXPECT_THAT(message("not a mesh"), HasSubstr("not an STL file"));
}

TEST(MeshReaderTest, bothOfOurGlbFilesAreReadInMm) {
  Mesh mesh = four_faces();
  mesh.views = {0, 3, 1, 200};
  const TexturedMesh model{.mesh = mesh, .corner_uv = {}, .atlas = {}};
  for (const auto& file : {*encode_glb(model), *encode_view_glb(model)}) {
    const auto read = parse_glb(file, "a.glb");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->faces.size(), 4u);
    ASSERT_EQ(read->normals.size(), 4u);
    for (std::size_t v = 0; v < 4; ++v) {
      EXPECT_NEAR(read->normals[v].norm(), 1.0F, 1e-5F);
      const auto same = std::ranges::find_if(mesh.vertices,
                                             [&](const auto& one) { return (one - read->vertices[v]).norm() < 1e-3F; });
      ASSERT_NE(same, mesh.vertices.end()) << read->vertices[v].transpose();
      if (!read->views.empty()) {
        EXPECT_EQ(read->views[v], mesh.views[static_cast<std::size_t>(same - mesh.vertices.begin())]);
      }
    }
  }
  EXPECT_EQ(parse_glb(*encode_view_glb(model), "a.glb")->views.size(), 4u);
}

/// A GLB file of one chunk of JSON and one of bytes.
std::string glb(const std::string& json, const std::string& binary) {
  std::string file;
  const auto put = [&](std::uint32_t value) { file.append(reinterpret_cast<const char*>(&value), 4); };
  put(0x46546C67);
  put(2);
  put(static_cast<std::uint32_t>(28 + json.size() + binary.size()));
  put(static_cast<std::uint32_t>(json.size()));
  put(0x4E4F534A);
  file += json;
  put(static_cast<std::uint32_t>(binary.size()));
  put(0x004E4942);
  return file + binary;
}

const std::string kTriangleGlb = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
                                 R"("nodes":[{"children":[1,1],"translation":[1,0,0]},{"mesh":0,"scale":[-2,1,1]}],)"
                                 R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
                                 R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
                                 R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";

std::string triangle_bytes() {
  const std::array<float, 9> corners{0, 0, 0, 0.001F, 0, 0, 0, 0.002F, 0};
  return {reinterpret_cast<const char*>(corners.data()), sizeof corners};
}

TEST(MeshReaderTest, aForeignGlbWithNodesIsReadAndAMirrorTurnsItsFaces) {
  const auto mesh = parse_glb(glb(kTriangleGlb, triangle_bytes()), "a.glb");
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->vertices.size(), 6u) << "the mesh is there twice";
  EXPECT_TRUE(mesh->vertices[1].isApprox(Eigen::Vector3f(998, 0, 0)));
  EXPECT_TRUE(mesh->vertices[5].isApprox(Eigen::Vector3f(1000, 2, 0)));
  EXPECT_EQ(mesh->faces[1], (Mesh::Face{3, 5, 4}));
  EXPECT_TRUE(mesh->normals.empty());
}

TEST(MeshReaderTest, anUnusableGlbIsRefused) {
  const auto message = [](const std::string& json, const std::string& binary = triangle_bytes()) {
    const auto mesh = parse_glb(glb(json, binary), "a.glb");
    EXPECT_FALSE(mesh) << json;
    return mesh ? "" : mesh.error().message;
  };
  EXPECT_THAT(message(kTriangleGlb, triangle_bytes().substr(4)), HasSubstr("behind its end"));
  EXPECT_THAT(message(with(kTriangleGlb, "\"count\":3", "\"count\":4")), HasSubstr("behind its end"));
  EXPECT_THAT(message(with(kTriangleGlb, "\"count\":3", "\"count\":-1")), HasSubstr("behind its end"));
  EXPECT_THAT(message(with(kTriangleGlb, "[1,1]", "[0]")), HasSubstr("without end"));
  EXPECT_THAT(message(with(kTriangleGlb, "5126", "5127")), HasSubstr("glTF does not know"));
  EXPECT_THAT(message(with(kTriangleGlb, "\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]")),
              HasSubstr("without compression"));
  EXPECT_THAT(message(with(kTriangleGlb, "\"POSITION\":0", "\"POSITION\":7")), HasSubstr("damaged"));
  EXPECT_THAT(message("{"), HasSubstr("damaged"));
  EXPECT_THAT(message("[]"), HasSubstr("no description"));
  EXPECT_THAT(parse_glb("glTF", "a.glb").error().message, HasSubstr("not a GLB file"));
  const std::string good = glb(kTriangleGlb, triangle_bytes());
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(parse_glb(std::string_view(good).substr(0, size), "a.glb")) << size;
  }
  std::mt19937 random(3);
  for (int round = 0; round < 20000; ++round) {
    std::string bad = good;
    for (int k = 0; k < 3; ++k) bad[random() % bad.size()] = static_cast<char>(random());
    (void)parse_glb(bad, "a.glb");
  }
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
