#include "pipeline/registration/register_views.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig {
namespace {

using testing::RigModel;

Context no_context() { return {}; }

/// The work piece seen without noise; rendered once.
std::vector<View> clean_views() {
  static const std::vector<View> views = testing::turn_around(testing::workpiece(), 8, RigModel{});
  return views;
}

/// Moves the calibration of each view away from the truth by a table angle error and a jolt. Seen from the camera the
/// jolts have no mean: that would be an error of the axis.
void disturb(std::vector<View>& views, double angle_deg, double shift_mm) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<double> angles;
  std::vector<Eigen::Vector3d> shifts;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    shifts.emplace_back(normal(random), normal(random), normal(random));
    angles.push_back(normal(random));
    mean += rot_y(view.angle_rad) * shifts.back() / static_cast<double>(views.size());
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Eigen::Vector3d shift = shifts[v] - rot_y(-views[v].angle_rad) * mean;
    Transform& t = views[v].range.camera_from_pose;
    t = t * small_motion(Eigen::Vector3d(0, to_radians(angle_deg) * angles[v], 0), shift_mm * shift);
  }
}

/// A scanner whose surface grows by up to `mm` at grazing incidence.
void swell_at_grazing_incidence(std::vector<View>& views, double mm) {
  for (View& view : views) {
    RangeImage& r = view.range;
    for (int v = 0; v < r.depth.rows; ++v) {
      for (int u = 0; u < r.depth.cols; ++u) {
        const Eigen::Vector3d ray = r.projection.unproject(u, v, 1.0).normalized();
        const cv::Vec3f n = r.normal(v, u);
        const double cosine = -ray.dot(Eigen::Vector3d(n[0], n[1], n[2]));
        r.depth(v, u) -= static_cast<float>(mm * (1.0 - cosine) / std::max(cosine, 0.2) * ray.z());
      }
    }
  }
}

/// Largest distance between the object's corners under two calibrations, after the common motion is taken out.
double inconsistency_mm(const std::vector<View>& views, const std::vector<View>& truth) {
  double worst = 0.0;
  const Transform common = views[0].range.camera_from_pose.inverse() * truth[0].range.camera_from_pose;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Transform move = views[v].range.camera_from_pose.inverse() * truth[v].range.camera_from_pose;
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d corner(k & 1 ? 30 : -30, k & 2 ? 60 : 0, k & 4 ? 30 : -30);
      worst = std::max(worst, (move * corner - common * corner).norm());
    }
  }
  return worst;
}

TEST(RegisterViews, LeavesAPerfectCalibrationAlone) {
  auto views = clean_views();
  const auto truth = views;
  const auto report = register_views(views, {}, no_context());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LT(inconsistency_mm(views, truth), 0.005);
  EXPECT_LT(report->median_after_mm, 0.003);
  EXPECT_TRUE(report->angle_observable);
}

TEST(RegisterViews, FindsTableAnglesThatTheStepperReportedWrong) {
  RigModel rig;
  rig.noise_mm = 0.01;
  auto views = testing::turn_around(testing::workpiece(), 8, rig);
  const auto truth = views;
  disturb(views, 0.03, 0.0);
  const double before = inconsistency_mm(views, truth);
  RegistrationOptions loose;
  loose.angle_sigma_deg = 0.1;
  loose.pair_bias_mm = 0.001;
  const auto report = register_views(views, loose, no_context());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_GT(before, 0.03);
  EXPECT_LT(inconsistency_mm(views, truth), 0.01);
  EXPECT_LT(report->median_after_mm, report->median_before_mm);
}

TEST(RegisterViews, PlacesImportedScansThatAreAMillimetreOff) {
  RigModel rig;
  rig.noise_mm = 0.02;
  auto views = testing::turn_around(testing::workpiece(), 8, rig);
  const auto truth = views;
  disturb(views, 0.4, 0.5);
  const auto report = register_views(views, RegistrationOptions::imported(), no_context());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LT(inconsistency_mm(views, truth), 0.03);
  EXPECT_NEAR(report->median_after_mm, 0.02, 0.01);
}

TEST(RegisterViews, ComparesAllViewsThatShareSurfaceWhereThereIsNoRing) {
  std::vector<View> views = clean_views();
  disturb(views, 0.08, 0.08);
  std::vector<View> mixed, truth;
  for (const std::size_t v : {0, 3, 6, 1, 4, 7, 2, 5}) {
    mixed.push_back(views[v]);
    mixed.back().angle_rad = 0.0;
    truth.push_back(clean_views()[v]);
  }
  const double before = inconsistency_mm(mixed, truth);
  const auto report = register_views(mixed, RegistrationOptions::placed(), no_context());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LT(inconsistency_mm(mixed, truth), 0.3 * before);
  for (const ViewFit& fit : report->views) EXPECT_GT(fit.overlap, 0.1) << "view " << fit.index;
}

TEST(RegisterViews, FindsAShiftedTurntableAxis) {
  auto views = clean_views();
  const auto truth = views;
  const Transform wrong_axis = small_motion(Eigen::Vector3d::Zero(), Eigen::Vector3d(0.04, 0, -0.03));
  for (View& view : views) {
    view.range.camera_from_pose = testing::camera_from_turntable(RigModel{}) * wrong_axis * rot_y(view.angle_rad);
  }
  RegistrationOptions options;
  options.axis_shift_sigma_mm = 0.1;
  options.pair_bias_mm = 0.001;
  const auto report = register_views(views, options, no_context());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_NEAR(report->axis_shift_mm, 0.05, 0.005);
  EXPECT_LT(inconsistency_mm(views, truth), 0.01);
}

TEST(RegisterViews, DoesNotMoveAllViewsOutwardsForAScannerThatIsWrongAtGrazingIncidence) {
  auto views = testing::turn_around(testing::workpiece(), 15, RigModel{});
  const auto truth = views;
  swell_at_grazing_incidence(views, 0.3);
  const auto report = register_views(views, RegistrationOptions::imported(), no_context());
  ASSERT_TRUE(report) << report.error().message;
  double outwards = 0.0;  // mean over the views
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Eigen::Vector3d axis_point(0.0, 40.0, 0.0);
    outwards += (truth[v].range.camera_from_pose * axis_point - views[v].range.camera_from_pose * axis_point).z() /
                static_cast<double>(views.size());
  }
  EXPECT_NEAR(outwards, 0.0, 0.03);
}

TEST(RegisterViews, HoldsTheAnglesOfABodyOfRevolutionAndReportsIt) {
  RigModel rig;
  rig.noise_mm = 0.01;
  const auto vase = testing::together({testing::upright_cylinder({0, 0, 0}, 25, 50), testing::ball({0, 55, 0}, 20)});
  auto views = testing::turn_around(vase, 8, rig);
  const auto report = register_views(views, {}, no_context());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->angle_observable);
  for (const ViewFit& fit : report->views) EXPECT_EQ(fit.angle_correction_deg, 0.0);
}

TEST(RegisterViews, MovesTheSilhouettesWithTheirView) {
  auto views = clean_views();
  disturb(views, 0.02, 0.0);
  const Transform right_from_left = small_motion(Eigen::Vector3d(0, 0.1, 0), Eigen::Vector3d(160, 0, 0));
  for (View& view : views) {
    view.silhouettes.resize(2);
    view.silhouettes[0].camera_from_pose = view.range.camera_from_pose;
    view.silhouettes[1].camera_from_pose = right_from_left * view.range.camera_from_pose;
  }
  ASSERT_TRUE(register_views(views, {}, no_context()));
  for (const View& view : views) {
    EXPECT_TRUE(view.silhouettes[0].camera_from_pose.isApprox(view.range.camera_from_pose, 1e-12));
    EXPECT_TRUE(view.silhouettes[1].camera_from_pose.isApprox(right_from_left * view.range.camera_from_pose, 1e-12));
  }
}

TEST(RegisterViews, GivesTheSameBitsOnAnyNumberOfThreads) {
  auto one = clean_views();
  disturb(one, 0.02, 0.0);
  auto many = one;
  with_threads(1, [&] { ASSERT_TRUE(register_views(one, {}, no_context())); });
  with_threads(3, [&] { ASSERT_TRUE(register_views(many, {}, no_context())); });
  for (std::size_t v = 0; v < one.size(); ++v) {
    EXPECT_EQ(one[v].range.camera_from_pose.matrix(), many[v].range.camera_from_pose.matrix());
  }
}

TEST(RegisterViews, ReturnsASingleViewAsItIs) {
  auto views = testing::turn_around(testing::workpiece(), 1, RigModel{});
  const auto truth = views;
  ASSERT_TRUE(register_views(views, {}, no_context()));
  EXPECT_TRUE(views[0].range.camera_from_pose.isApprox(truth[0].range.camera_from_pose, 1e-9));
}

TEST(RegisterViews, RefusesMapsOfDifferentSizes) {
  auto views = testing::turn_around(testing::workpiece(), 2, RigModel{});
  views[1].range.sigma = cv::Mat1f(3, 3, 0.0F);
  const auto report = register_views(views, {}, no_context());
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::invalid_input);
}

TEST(RegisterViews, ReportsViewsWithoutMeasurements) {
  auto views = testing::turn_around(testing::ball({0, -500, 0}, 1), 8, RigModel{});
  const auto report = register_views(views, {}, no_context());
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::degenerate);
}

TEST(RegisterViews, ReportsViewsWithoutSharedSurface) {
  auto views = testing::turn_around(testing::workpiece(), 2, RigModel{});
  views[1].range.camera_from_pose = views[1].range.camera_from_pose * Eigen::Translation3d(0, 300, 0);
  const auto report = register_views(views, {}, no_context());
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::no_overlap);
}

TEST(RegisterViews, StopsOnRequest) {
  auto views = clean_views();
  std::stop_source source;
  source.request_stop();
  const auto report = register_views(views, {}, {source.get_token(), {}});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
