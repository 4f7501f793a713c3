#include "pipeline/pose/estimate_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/pipeline/pose/posed_scan.h"
#include "tests/unit/pipeline/pose/turned_solids.h"

namespace scanrig {
namespace {

using testing::PosedScan;
using testing::scan;
using testing::Solid;
using testing::turn;

const Eigen::Matrix3d kOnItsSide = turn(40, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitZ());

constexpr double kDarkFootMm = 14.0;

const PosedScan& workpiece_on_its_side() {
  static const PosedScan s = scan(testing::workpiece(), kOnItsSide);
  return s;
}

void expect_found(const Result<PoseEstimate>& estimate, const PosedScan& s) {
  ASSERT_TRUE(estimate) << estimate.error().message;
  const Transform& t = estimate->pose1_from_pose2;
  EXPECT_LT(to_degrees(rotation_angle(t.linear().transpose() * s.pose1_from_pose2.linear())), 0.1);
  const Eigen::Vector3d middle = s.pose1_from_pose2.inverse() * Eigen::Vector3d(0, 30, 0);
  EXPECT_LT((t * middle - s.pose1_from_pose2 * middle).norm(), 0.1);
}

/// `part`: part of the message.
void expect_error(const Result<PoseEstimate>& estimate, ErrorCode code, const std::string& part = "") {
  ASSERT_FALSE(estimate) << "found by " << estimate->best.generator;
  EXPECT_EQ(estimate.error().code, code) << estimate.error().message;
  EXPECT_NE(estimate.error().message.find(part), std::string::npos) << estimate.error().message;
}

TEST(EstimatePose, FindsAnObjectLaidOnItsSideByTheFacetsOfItsHull) {
  PoseOptions options;
  options.point_pairs = false;
  const auto estimate = workpiece_on_its_side().estimate(options);
  expect_found(estimate, workpiece_on_its_side());
  EXPECT_EQ(estimate->best.generator, "hull");
  EXPECT_GT(estimate->best.agreement.confirmed, 0.3);
  EXPECT_LT(estimate->best.agreement.contradicted, 0.1);
  EXPECT_FALSE(estimate->alternatives.empty());
}

TEST(EstimatePose, FindsItByTheTessellatedSphereOfThePaper) {
  PoseOptions options;
  options.point_pairs = false;
  options.rests = PoseOptions::Rests::egi;
  const auto estimate = workpiece_on_its_side().estimate(options);
  expect_found(estimate, workpiece_on_its_side());
  EXPECT_EQ(estimate->best.generator, "egi");
}

TEST(EstimatePose, FindsItByPointPairsAlone) {
  PoseOptions options;
  options.stable_tangent_planes = false;
  const auto estimate = workpiece_on_its_side().estimate(options);
  expect_found(estimate, workpiece_on_its_side());
  EXPECT_EQ(estimate->best.generator, "point pairs");
}

/// Nearly all surface that both poses see is upright: the tables' contacts hold the height.
TEST(EstimatePose, FindsAnObjectTurnedUpsideDown) {
  const Solid stool =
      testing::together({testing::block({-32, 0, -22}, {32, 20, 22}), testing::block({-25, 15, -20}, {-13, 45, -2}),
                         testing::block({10, 15, -15}, {28, 45, 15}), testing::ball({-10, 20, 18}, 12)});
  const PosedScan s = scan(stool, turn(77, Eigen::Vector3d::UnitY()) * turn(180, Eigen::Vector3d::UnitX()));
  PoseOptions options;
  options.point_pairs = false;
  expect_found(s.estimate(options), s);
}

TEST(EstimatePose, FindsAnObjectHeldByPuttyInNoRestAtAll) {
  const PosedScan s = scan(testing::workpiece(), turn(63, {1, 2, -1}), 5.0);
  expect_found(s.estimate(), s);
}

TEST(EstimatePose, DetectsThatTheObjectWasNotTurnedOver) {
  const PosedScan s = scan(testing::workpiece(), turn(65, Eigen::Vector3d::UnitY()));
  expect_error(s.estimate(), ErrorCode::same_rest, "not turned over");
}

TEST(EstimatePose, DecidesByASmallFeatureWhereTheRestIsSymmetric) {
  const Solid box = testing::together({testing::block({-30, 0, -20}, {30, 30, 20}), testing::ball({26, 19, 7}, 6)});
  const PosedScan s = scan(box, turn(25, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitX()));
  expect_found(s.estimate(), s);
}

/// Its wall slides along its axis: rim, foot and handle hold it, which are a small part of what both poses see.
TEST(EstimatePose, HoldsAMugAlongItsAxis) {
  const Solid wall = testing::lathed({{0, 0}, {19, 0}, {22, 54}, {18, 54}, {15, 6}, {0, 6}});
  const PosedScan scan = testing::scan(testing::together({wall, testing::ring({24, 28, 0}, 11, 2.5)}),
                                       turn(40, Eigen::Vector3d::UnitY()) * turn(80, Eigen::Vector3d::UnitX()));
  expect_found(scan.estimate(), scan);
}

/// As a dark part does that mirrors the screen: in every view another strip of the object is taken for background.
TEST(EstimatePose, TakesNoSingleViewsWordForFreeSpace) {
  PosedScan s = scan(testing::workpiece(), kOnItsSide);  // copies would share their images
  constexpr int kStrip = 14;
  for (std::vector<View>* views : {&s.views1, &s.views2}) {
    for (std::size_t i = 0; i < views->size(); ++i) {
      RangeImage& range = (*views)[i].range;
      const int first = range.depth.cols / 2 + kStrip * (static_cast<int>(i) - 4);
      const cv::Rect strip(first, 0, kStrip, range.depth.rows);
      range.depth(strip) = kUnmeasured;
      range.sigma(strip) = kUnmeasured;
      range.background(strip) = 255;
    }
  }
  expect_found(s.estimate(), s);
  PoseOptions credulous;
  credulous.agreement.witnesses = 1;
  expect_error(s.estimate(credulous), ErrorCode::no_overlap);
}

/// The same in every view of one pose: the foot of the object is dark.
TEST(EstimatePose, TakesSurfacesThatAgreeForMoreThanImagesThatDeny) {
  PosedScan s = scan(testing::workpiece(), kOnItsSide);
  for (View& view : s.views1) {
    const Transform pose_from_camera = view.range.camera_from_pose.inverse();
    for (int v = 0; v < view.range.depth.rows; ++v) {
      for (int u = 0; u < view.range.depth.cols; ++u) {
        const float depth = view.range.depth(v, u);
        if (std::isnan(depth) || (pose_from_camera * view.range.projection.unproject(u, v, depth)).y() > kDarkFootMm) {
          continue;
        }
        view.range.depth(v, u) = view.range.sigma(v, u) = kUnmeasured;
        view.range.background(v, u) = 255;
      }
    }
  }
  expect_found(s.estimate(), s);
  PoseOptions credulous;
  credulous.max_denied_by_images = 0.0;
  expect_error(s.estimate(credulous), ErrorCode::no_overlap);
}

TEST(EstimatePose, RefusesTwoDifferentObjects) {
  PosedScan s = workpiece_on_its_side();
  const Solid other = testing::together({testing::ball({0, 30, 0}, 30), testing::block({-10, 0, -45}, {10, 20, 0})});
  s.views2 = testing::turn_around(other, 8, testing::kPoseRig, 3);
  s.solid2 = testing::closed(other);
  expect_error(s.estimate(), ErrorCode::no_overlap);
}

TEST(EstimatePose, RefusesASolidThatIsNotClosed) {
  PosedScan s = workpiece_on_its_side();
  s.solid2.faces.pop_back();
  expect_error(s.estimate(), ErrorCode::not_closed);
}

TEST(EstimatePose, RefusesAPoseWithoutMeasurements) {
  PosedScan s = workpiece_on_its_side();
  s.views1.clear();
  expect_error(s.estimate(), ErrorCode::degenerate);
}

TEST(EstimatePose, StopsOnRequest) {
  std::stop_source source;
  source.request_stop();
  expect_error(workpiece_on_its_side().estimate({}, {source.get_token(), {}}), ErrorCode::stopped);
}

TEST(EstimatePose, GivesTheSameBitsOnAnyNumberOfThreads) {
  Result<PoseEstimate> one;
  Result<PoseEstimate> many;
  with_threads(1, [&] { one = workpiece_on_its_side().estimate(); });
  with_threads(3, [&] { many = workpiece_on_its_side().estimate(); });
  ASSERT_TRUE(one && many);
  EXPECT_TRUE(one->pose1_from_pose2.matrix() == many->pose1_from_pose2.matrix());
  EXPECT_EQ(one->best.agreement.confirmed, many->best.agreement.confirmed);
}

}  // namespace
}  // namespace scanrig
