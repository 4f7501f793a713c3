#include "pipeline/reconstruct/live_mesh.h"

#include <gtest/gtest.h>

#include <limits>

namespace scanrig {
namespace {

constexpr int kWidth = 160, kHeight = 120;

Projection pinhole() { return {.width = kWidth, .height = kHeight, .fx = 200, .fy = 200, .cx = 79.5, .cy = 59.5}; }

/// A camera at 500 mm from a wall, which steps back by 140 mm in the right half; a border is not measured.
View wall_with_step() {
  View view;
  view.range.projection = pinhole();
  view.range.depth = cv::Mat1f(kHeight, kWidth, 500.0F);
  view.range.depth.colRange(kWidth / 2, kWidth).setTo(640.0F);
  view.range.depth.rowRange(0, 10).setTo(std::numeric_limits<float>::quiet_NaN());
  view.range.camera_from_pose.translation() = Eigen::Vector3d(0, 0, 600);
  return view;
}

Camera left_camera() {
  Camera left;
  left.projection = pinhole();
  left.camera_from_turntable.translation() = Eigen::Vector3d(0, 0, 600);
  return left;
}

// 200 and 150 of 255, linear, as sRGB [IEC 61966-2-1].
constexpr std::array<std::uint8_t, 3> kShownRed{229, 0, 0}, kShownGreen{0, 202, 0};

/// Red in the left half, green in the right, as BGR.
LivePhoto two_colours() {
  LivePhoto photo;
  photo.image = cv::Mat3b(kHeight, kWidth, cv::Vec3b(0, 0, 200));
  photo.image.colRange(kWidth / 2, kWidth).setTo(cv::Vec3b(0, 150, 0));
  return photo;
}

TEST(LiveMesh, AViewIsAGridThatIsNotJoinedAcrossAStep) {
  const Mesh mesh = live_mesh_of_view(wall_with_step(), left_camera(), two_colours(), 1000);
  EXPECT_LE(mesh.vertices.size(), 1000u);
  EXPECT_GE(mesh.vertices.size(), 250u);
  ASSERT_FALSE(mesh.faces.empty());
  for (const auto& face : mesh.faces) {
    for (const auto corner : face) EXPECT_EQ(mesh.vertices[corner].z(), mesh.vertices[face[0]].z());
    const Eigen::Vector3f a = mesh.vertices[face[0]];
    const Eigen::Vector3f normal = (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
    EXPECT_LT(normal.z(), 0.0F) << "faces turn to the camera, which looks along +z";
  }
}

TEST(LiveMesh, AViewIsInItsPosesFrameAndHasThePhotographsColours) {
  const Mesh mesh = live_mesh_of_view(wall_with_step(), left_camera(), two_colours());
  ASSERT_EQ(mesh.colour.size(), mesh.vertices.size());
  bool has_red = false, has_green = false;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const bool is_near = mesh.vertices[v].z() < -80.0F;
    EXPECT_NEAR(mesh.vertices[v].z(), is_near ? -100.0F : 40.0F, 1e-3F) << "600 mm before the camera's frame";
    if (is_near) {
      has_red = true;
      EXPECT_EQ(mesh.colour[v], kShownRed);
    } else {
      has_green = true;
      EXPECT_EQ(mesh.colour[v], kShownGreen);
    }
  }
  EXPECT_TRUE(has_red && has_green);
}

TEST(LiveMesh, ADarkPhotographIsShownAsBrightAsTheFinishedTexture) {
  LivePhoto photo = two_colours();
  EXPECT_NEAR(live_gain(wall_with_step(), left_camera(), photo), 0.8 / (200.0 / 255.0), 1e-3);
  photo.image = photo.image * 0.5;
  photo.gain = live_gain(wall_with_step(), left_camera(), photo);
  EXPECT_NEAR(photo.gain, 0.8 / (100.0 / 255.0), 1e-3);
  const Mesh mesh = live_mesh_of_view(wall_with_step(), left_camera(), photo);
  EXPECT_EQ(mesh.colour.back()[1], 203) << "75 of 255 with this gain is 153";
  photo.image = photo.image * 0.1;
  EXPECT_DOUBLE_EQ(live_gain(wall_with_step(), left_camera(), photo), 3.0) << "a dark object stays dark";
  EXPECT_DOUBLE_EQ(live_gain(wall_with_step(), left_camera(), {}), 1.0);
}

TEST(LiveMesh, WithoutAPhotographItIsGrey) {
  const Mesh mesh = live_mesh_of_view(wall_with_step(), left_camera(), {});
  for (const auto& colour : mesh.colour) EXPECT_EQ(colour, (std::array<std::uint8_t, 3>{150, 150, 150}));
}

TEST(LiveMesh, AVertexHasTheColourOfTheViewThatSeesIt) {
  Mesh mesh;
  mesh.vertices = {{-50, 0, -100}, {50, 0, 40}, {-50, 0, 0}, {-50, 0, -100}};
  mesh.normals = {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}, {0, 0, 1}};
  colour_by_views(mesh, {wall_with_step()}, left_camera(), [](std::size_t) { return two_colours(); });
  EXPECT_EQ(mesh.colour[0], kShownRed);
  EXPECT_EQ(mesh.colour[1], kShownGreen);
  EXPECT_EQ(mesh.colour[2], (std::array<std::uint8_t, 3>{150, 150, 150})) << "behind what the view sees";
  EXPECT_EQ(mesh.colour[3], (std::array<std::uint8_t, 3>{150, 150, 150})) << "turned away";
}

}  // namespace
}  // namespace scanrig
