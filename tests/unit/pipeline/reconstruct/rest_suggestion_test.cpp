#include "pipeline/reconstruct/rest_suggestion.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/image_codec.h"
#include "pipeline/mesh/solid_properties.h"
#include "tests/unit/pipeline/pose/solid_mesh.h"

namespace scanrig {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Both cameras before the table, on the side of +z, 22 degrees up.
Calibration rig() {
  Calibration calibration;
  for (Camera* camera : {&calibration.left, &calibration.right}) {
    camera->projection = {.width = 640, .height = 480, .fx = 1600, .fy = 1600, .cx = 319.5, .cy = 239.5};
    camera->camera_from_turntable = testing::camera_from_turntable({});
  }
  calibration.left.camera_from_turntable.translation().x() += 80.0;
  calibration.right.camera_from_turntable.translation().x() -= 80.0;
  calibration.table_radius_mm = 90.0;
  return calibration;
}

NextRest lying_on(const Eigen::Vector3d& normal, double gain = 0.5) {
  NextRest next;
  next.rest.normal = normal.normalized();
  next.turn = Eigen::Quaterniond::FromTwoVectors(next.rest.normal, -Eigen::Vector3d::UnitY());
  next.gain = gain;
  return next;
}

std::string sentence_of(const NextRest& next) {
  const auto made = suggestions_of({.rests = {next}}, rig());
  return made.empty() ? "" : made.front().sentence;
}

TEST(RestSuggestion, SaysHowToLayItAsOneSeesItFromTheCameras) {
  EXPECT_EQ(sentence_of(lying_on({0, 0, -1}, 0.812)), "Lay it on its back: shows 81 % of what is unseen.");
  EXPECT_THAT(sentence_of(lying_on({0.1, 0.2, 1})), StartsWith("Lay it on its front:"));
  EXPECT_THAT(sentence_of(lying_on({1, -0.3, 0.2})), StartsWith("Lay it on its right side:"));
  EXPECT_THAT(sentence_of(lying_on({-1, 0, 0.2})), StartsWith("Lay it on its left side:"));
  EXPECT_THAT(sentence_of(lying_on({0.2, 1, 0})), StartsWith("Turn it upside down:"));
  EXPECT_THAT(sentence_of(lying_on({0, -1, -0.6})), StartsWith("Tilt it towards its back:"));
}

TEST(RestSuggestion, TheBestTwoAreSuggestedAndADoubtIsSaid) {
  NextRests found{.rests = {lying_on({1, 0, 0}), lying_on({0, 1, 0}), lying_on({0, 0, 1})}};
  found.rests[1].outlook = PoseOutlook::small_overlap;
  const auto made = suggestions_of(found, rig());
  ASSERT_EQ(made.size(), 2u);
  EXPECT_EQ(made[0].doubt, "");
  EXPECT_THAT(made[1].doubt, HasSubstr("too little is seen in both poses"));
}

TEST(RestSuggestion, TheReportSaysWhetherItWasFollowed) {
  const std::vector<NextRest> suggested = {lying_on({1, 0, 0}, 0.8), lying_on({0, 1, 0}, 0.4)};
  const auto after = [&](const Eigen::Vector3d& down_in_pose1) {
    Transform pose1_from_pose2 = Transform::Identity();
    pose1_from_pose2.linear() =
        Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitY(), down_in_pose1).toRotationMatrix();
    return next_rest_json(suggested, pose1_from_pose2);
  };
  const auto first = after({1, 0.15, 0});
  EXPECT_EQ(first["taken"], 1);
  EXPECT_TRUE(first["sentence"].is_null());
  EXPECT_EQ(first["suggested"][0]["gain"], 0.8);
  EXPECT_EQ(after({0, 1, 0})["taken"], 2);
  const auto other = after({0, 0, 1});
  EXPECT_TRUE(other["taken"].is_null());
  EXPECT_THAT(other["sentence"].get<std::string>(), HasSubstr("another rest"));
  EXPECT_NEAR(other["down_in_pose1"][2].get<double>(), 1.0, 1e-9);
}

/// A red box whose base is unseen so far.
Mesh red_box() {
  Mesh mesh = testing::mesh_of(testing::block({-30, 0, -20}, {30, 36, 20}), {-40, -3, -30}, {40, 40, 30}, 2.5);
  for (const Eigen::Vector3f& v : mesh.vertices) {
    mesh.views.push_back(v.y() > 1.0F ? 2 : 0);
    mesh.colour.push_back({200, 20, 20});
  }
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

struct Shares {
  double red = 0.0, orange = 0.0;
  double mean_orange_row = 0.0, mean_red_row = 0.0;
};

Shares shares_of(const std::string& png) {
  const auto decoded = decode_image(png);
  EXPECT_TRUE(decoded);
  Shares shares;
  if (!decoded) return shares;
  const cv::Mat3b image = *decoded;
  for (int row = 0; row < image.rows; ++row) {
    for (const cv::Vec3b& bgr : cv::Mat3b(image.row(row))) {
      if (bgr[2] > 90 && bgr[1] < 40) {
        shares.red += 1.0;
        shares.mean_red_row += row;
      } else if (bgr[2] > 90 && bgr[1] > bgr[2] / 3 && bgr[0] < bgr[1] / 2) {
        shares.orange += 1.0;
        shares.mean_orange_row += row;
      }
    }
  }
  shares.mean_red_row /= std::max(1.0, shares.red);
  shares.mean_orange_row /= std::max(1.0, shares.orange);
  shares.red /= static_cast<double>(image.total());
  shares.orange /= static_cast<double>(image.total());
  return shares;
}

TEST(RestImage, UpsideDownTheUnseenBaseIsOnTop) {
  const auto png = draw_rest(red_box(), lying_on({0, 1, 0}), rig());
  ASSERT_TRUE(png) << png.error().message;
  const Shares shares = shares_of(*png);
  EXPECT_GT(shares.red, 0.1);
  EXPECT_GT(shares.orange, 0.03);
  EXPECT_LT(shares.mean_orange_row, shares.mean_red_row) << "above its sides";
}

/// Pose 2 is of a green box, a little slimmer, so that no sides coincide: as the choice joins them it stands on the red
/// one, or in it.
TEST(ChoiceImage, ShowsBothPosesWhereTheChoicePutsThemAndNothingUnmeasured) {
  const Mesh red = red_box();
  Mesh green = red;
  for (auto& colour : green.colour) colour = {20, 200, 20};
  for (auto& vertex : green.vertices) vertex = {0.97F * vertex.x(), vertex.y(), 0.97F * vertex.z()};
  const auto green_share = [&](double up_mm) {
    Transform pose1_from_pose2 = Transform::Identity();
    pose1_from_pose2.translation().y() = up_mm;
    const auto png = draw_choice(red, green, pose1_from_pose2, rig());
    EXPECT_TRUE(png) << png.error().message;
    EXPECT_LT(shares_of(*png).orange, 0.003);
    const cv::Mat3b image = *decode_image(*png);
    EXPECT_EQ(image.cols, 2 * image.rows);
    for (const bool is_right : {false, true}) {
      const cv::Mat3b half = image.colRange(is_right ? image.rows : 0, is_right ? image.cols : image.rows);
      EXPECT_GT(cv::countNonZero(half.reshape(1) > 90), 0.01 * static_cast<double>(half.total()))
          << "it is in the image";
    }
    int count = 0;
    for (const cv::Vec3b& bgr : image) count += bgr[1] > 90 && bgr[2] < 60 ? 1 : 0;
    return static_cast<double>(count) / static_cast<double>(image.total());
  };
  EXPECT_GT(green_share(50), 0.05);
  EXPECT_LT(green_share(-3), 0.5 * green_share(50));
  Mesh bare = red;
  bare.colour.clear();
  EXPECT_EQ(draw_choice(red, bare, Transform::Identity(), rig()).error().code, ErrorCode::invalid_input);
}

TEST(RestImage, AsItStandsTheBaseIsHidden) {
  const auto png = draw_rest(red_box(), lying_on({0, -1, 0}), rig());
  ASSERT_TRUE(png) << png.error().message;
  EXPECT_LT(shares_of(*png).orange, 0.01);
}

TEST(RestImage, RefusesAMeshWithoutColours) {
  Mesh mesh = red_box();
  mesh.colour.clear();
  const auto png = draw_rest(mesh, lying_on({0, 1, 0}), rig());
  ASSERT_FALSE(png);
  EXPECT_EQ(png.error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
