#include "sim/scene/object.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/own_folder.h"

namespace scanrig::sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3f;

class ObjectFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = own_folder();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  void expect_refused(const fs::path& file, ErrorCode code, const std::string& words) {
    const auto object = load_object(file, 100.0);
    ASSERT_FALSE(object);
    EXPECT_EQ(object.error().code, code);
    EXPECT_NE(object.error().message.find(words), std::string::npos) << object.error().message;
    EXPECT_NE(object.error().message.find(file.filename().string()), std::string::npos) << object.error().message;
  }

  fs::path folder_;
};

const char* const kTetrahedron = "v 0 0 0\nv 3 0 0\nv 0 4 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST_F(ObjectFile, IsScaledSoThatItsFarthestPointsAreTheHeightApart) {
  const auto object = load_object(write("t.obj", kTetrahedron), 100.0);
  ASSERT_TRUE(object) << object.error().message;
  EXPECT_NEAR(largest_extent(object->mesh.vertices), 100.0, 1e-9);  // 5 units, from (3,0,0) to (0,4,0)
  EXPECT_TRUE(is_closed(object->mesh));
  EXPECT_NEAR(volume(object->mesh), 2.0 * 8000.0, 1e-6);
}

TEST_F(ObjectFile, InObjMayUseNegativeIndicesAndPolygons) {
  const auto object =
      load_object(write("q.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4//1 -3//1 -2//1 -1//1\n"), 10.0);
  ASSERT_TRUE(object) << object.error().message;
  EXPECT_EQ(object->mesh.triangles.size(), 2U);
}

TEST_F(ObjectFile, InPlyKeepsItsVertexColours) {
  const auto file =
      write("c.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n"
            "0 0 0 255 0 0\n1 0 0 255 0 0\n0 1 0 255 0 0\n3 0 1 2\n");
  const auto object = load_object(file, 10.0);
  ASSERT_TRUE(object) << object.error().message;
  const Vector3f red = object->colour->albedo({{1, 1, 0}, 0, 0.3, 0.3, 0.1});
  EXPECT_GT(red.x(), 0.7F);
  EXPECT_LT(red.y(), 0.2F);
}

TEST_F(ObjectFile, TakesTheTextureBesideIt) {
  cv::Mat image(64, 64, CV_8UC3, cv::Scalar(40, 200, 40));
  image.rowRange(0, 32).setTo(cv::Scalar(40, 40, 200));  // upper half red, lower half green
  cv::imwrite((folder_ / "duck_texture.png").string(), image);
  const auto file =
      write("duck_mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.1\nvt 0.9 0.1\nvt 0.1 0.9\nf 1/1 2/2 3/3\n");
  const auto object = load_object(file, 10.0);
  ASSERT_TRUE(object) << object.error().message;
  const Vector3f low = object->colour->albedo({{0, 0, 0}, 0, 0.05, 0.05, 0.01});
  const Vector3f high = object->colour->albedo({{0, 0, 0}, 0, 0.05, 0.9, 0.01});
  EXPECT_GT(low.y(), low.x());
  EXPECT_GT(high.x(), high.y());
}

TEST_F(ObjectFile, TakesTexturesOfAnyDepth) {
  const auto file = write("cup.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.1\nvt 0.9 0.1\nvt 0.1 0.9\nf 1/1 2/2 3/3\n");
  const std::array<cv::Mat, 3> images = {cv::Mat(8, 8, CV_16UC3, cv::Scalar(40 * 257, 200 * 257, 40 * 257)),
                                         cv::Mat(8, 8, CV_8UC4, cv::Scalar(40, 200, 40, 0)),
                                         cv::Mat(8, 8, CV_8UC1, cv::Scalar(200))};
  for (const cv::Mat& image : images) {
    cv::imwrite((folder_ / "cup_texture.png").string(), image);
    const auto object = load_object(file, 10.0);
    ASSERT_TRUE(object) << object.error().message;
    EXPECT_NEAR(object->colour->albedo({{0, 0, 0}, 0, 0.3, 0.3, 0.01}).y(), 0.62F, 0.005F);
  }
}

TEST_F(ObjectFile, WithATextureThatCannotBeReadIsRefused) {
  write("cup_texture.png", "not an image");
  expect_refused(write("cup.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.1\nvt 0.9 0.1\nvt 0.1 0.9\nf 1/1 2/2 3/3\n"),
                 ErrorCode::invalid_input, "cup_texture.png");
}

TEST_F(ObjectFile, InGlbIsReadWithItsNodes) {
  // One triangle, its node shifted and doubled; a GLB written by hand.
  const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
      R"("nodes":[{"mesh":0,"scale":[2,2,2],"translation":[5,0,0]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";
  while (json.size() % 4) json += ' ';
  const auto word = [](std::uint32_t v) { return std::string(reinterpret_cast<const char*>(&v), 4); };
  const auto size = static_cast<std::uint32_t>(json.size());
  const std::string glb = "glTF" + word(2) + word(12 + 8 + size + 8 + 36) + word(size) + "JSON" + json + word(36) +
                          std::string("BIN\0", 4) + std::string(reinterpret_cast<const char*>(positions), 36);
  const auto object = load_object(write("t.glb", glb), std::sqrt(8.0));
  ASSERT_TRUE(object) << object.error().message;
  ASSERT_EQ(object->mesh.vertices.size(), 3U);
  EXPECT_NEAR(object->mesh.vertices[0].x(), 5.0, 1e-6);
  EXPECT_NEAR((object->mesh.vertices[2] - object->mesh.vertices[0]).norm(), 2.0, 1e-6);
}

TEST_F(ObjectFile, ThatDoesNotExistIsNamed) { expect_refused(folder_ / "none.obj", ErrorCode::not_found, "none.obj"); }
TEST_F(ObjectFile, OfAnotherKindIsRefused) {
  expect_refused(write("m.step", "x"), ErrorCode::unsupported, "OBJ, PLY or GLB");
}
TEST_F(ObjectFile, WithoutFacesIsRefused) {
  expect_refused(write("m.obj", "v 0 0 0\n"), ErrorCode::invalid_input, "no faces");
}
TEST_F(ObjectFile, WithoutAHeaderIsRefused) {
  expect_refused(write("m.ply", "hello"), ErrorCode::invalid_input, "PLY");
}
TEST_F(ObjectFile, ThatIsNoGlbIsRefused) { expect_refused(write("m.glb", "hello"), ErrorCode::invalid_input, "GLB"); }
TEST_F(ObjectFile, WithANanIsRefused) {
  expect_refused(write("m.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), ErrorCode::invalid_input, "not a number");
}
TEST_F(ObjectFile, WithAnIndexTooLargeIsRefused) {
  expect_refused(write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), ErrorCode::invalid_input, "does not exist");
}
TEST_F(ObjectFile, WithoutSurfaceIsRefused) {
  expect_refused(write("m.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n"), ErrorCode::invalid_input, "no surface");
}
TEST_F(ObjectFile, CutShortIsRefused) {
  expect_refused(write("m.ply",
                       "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                       "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\nabc"),
                 ErrorCode::invalid_input, "m.ply");
}
TEST_F(ObjectFile, ThatPromisesMoreThanItHoldsIsRefusedAtOnce) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 99999999999999\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  expect_refused(write("m.ply", header + "0 0 0\n1 0 junk\n"), ErrorCode::invalid_input, "no faces");
}
TEST(Object, OfNoHeightIsRefused) { EXPECT_EQ(load_object({}, 0.0).error().code, ErrorCode::invalid_input); }

TEST(Colours, CanBeKeyedAndMeasured) {
  const auto blue = measurable({0.0F, 0.0F, 1.0F}), black = measurable({0.0F, 0.0F, 0.0F});
  EXPECT_LE(blue.z(), 1.1F * std::max(blue.x(), blue.y()) + 1e-6F);
  EXPECT_GE(black.minCoeff(), 0.119F);
}

TEST(SolidColours, HaveContrastEverywhere) {
  const auto check = [](const SurfaceColour& colour) {
    for (int patch = 0; patch < 40; ++patch) {
      const Eigen::Vector3d corner(3.0 * (patch % 7), 5.0 * (patch % 5), 2.0 * patch);
      double sum = 0.0, squares = 0.0;
      for (int i = 0; i < 400; ++i) {
        const int column = i % 20, row = i / 20;
        const Eigen::Vector3d p = corner + 0.15 * Eigen::Vector3d(column, row, 0.0);
        const double value = colour.albedo({p, 0, 0, 0, 0.15}).y();
        sum += value / 400, squares += value * value / 400;
      }
      EXPECT_GT(std::sqrt(squares - sum * sum) / sum, 0.04) << "patch " << patch;
    }
  };
  check(*painted_colour());
  check(*stone_colour());
}

}  // namespace
}  // namespace scanrig::sim
