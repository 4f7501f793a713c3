#include "sim/scene/rig_variation.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "core/units.h"
#include "sim/scene/lens_residual.h"
#include "sim/scene/ray_map.h"
#include "sim/scene/scene.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(DrawnRig, IsWithinTheRangesAndInItsOwnFrame) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const DrawnRig rig = draw_rig({.seed = seed}, 1.0);
    const Vector3d left = rig.geometry.left.centre(), right = rig.geometry.right.centre();
    EXPECT_GT((left - right).norm(), 119.9);
    EXPECT_LT((left - right).norm(), 200.1);
    const Vector3d middle = 0.5 * (left + right);
    EXPECT_NEAR(middle.x(), 0.0, 1e-9);
    EXPECT_GT(middle.z(), 0.0);
    const double elevation = to_degrees(std::asin((middle - Vector3d(0.0, 45.0, 0.0)).normalized().y()));
    EXPECT_GT(elevation, 14.0);
    EXPECT_LT(elevation, 31.0);
    EXPECT_LT(left.x(), right.x());
    for (const Eye* eye : {&rig.geometry.left, &rig.geometry.right}) {
      EXPECT_LT(std::abs(eye->fx / 4266.7 - 1.0), 0.031);
      const Vector2d aim = eye->project({0.0, 45.0, 0.0});
      EXPECT_LT((aim - Vector2d(640.0, 480.0)).norm(), 80.0);
    }
  }
}

TEST(DrawnRig, IsTheSameForTheSameSeedAndDrawsEachErrorAlone) {
  const DrawnRig a = draw_rig({.seed = 9}, 1.0), b = draw_rig({.seed = 9}, 1.0), other = draw_rig({.seed = 10}, 1.0);
  EXPECT_EQ(a.geometry.left.fx, b.geometry.left.fx);
  EXPECT_EQ(a.geometry.left.eye_from_turntable.matrix(), b.geometry.left.eye_from_turntable.matrix());
  EXPECT_NE(a.geometry.left.fx, other.geometry.left.fx);
  const DrawnRig without = draw_rig({.seed = 9, .mounting = 0.0, .gear = 0.0}, 1.0);
  EXPECT_EQ(without.geometry.left.fx, a.geometry.left.fx);
  EXPECT_EQ(without.table.phase_rad, a.table.phase_rad);
  EXPECT_EQ(without.table.gear_factor, 1.0);
  EXPECT_NEAR((without.geometry.left.centre() - without.geometry.right.centre()).norm(), 160.0, 1e-9);
}

TEST(DrawnRig, SeesTheSameAtAnyResolution) {
  const DrawnRig full = draw_rig({}, 1.0), quarter = draw_rig({}, 0.25);
  const Vector2d a = full.geometry.left.project({10.0, 30.0, 20.0}),
                 b = quarter.geometry.left.project({10.0, 30.0, 20.0});
  EXPECT_NEAR((a.x() + 0.5) / 4.0 - 0.5, b.x(), 1e-6);
  EXPECT_NEAR((a.y() + 0.5) / 4.0 - 0.5, b.y(), 1e-6);
}

TEST(DrawnRig, WithEverySizeAtZeroIsTheDefaultRig) {
  RigVariation none;
  for (const auto& value : kRigVariationNames) none.*value.member = 0.0;
  const DrawnRig rig = draw_rig(none, 1.0);
  const RigGeometry standard = default_rig();
  const Vector3d point(20.0, 50.0, -30.0);
  EXPECT_LT((rig.geometry.left.project(point) - standard.left.project(point)).norm(), 1e-9);
  EXPECT_LT((rig.geometry.right.project(point) - standard.right.project(point)).norm(), 1e-9);
  EXPECT_EQ(rig.table.true_deg(123.0), 123.0);
  EXPECT_TRUE(rig.table.turntable_from_ideal(0.7).isApprox(Transform::Identity(), 1e-12));
}

TEST(Table, RunsOutByAboutTheSizeAskedAndRepeats) {
  const DrawnRig rig = draw_rig({.runout_mm = 0.002}, 1.0);
  double squares = 0.0;
  for (int deg = 0; deg < 360; ++deg) squares += rig.table.motion(deg).translation().squaredNorm() / 3.0;
  EXPECT_NEAR(std::sqrt(squares / 360.0), 0.002, 0.0005);
  EXPECT_EQ(rig.table.motion(45.0).matrix(), rig.table.motion(405.0 - 360.0).matrix());
}

TEST(LensResidual, HasTheRmsAskedAfterBrownsModelIsFitted) {
  const Eye eye = draw_rig({.residual_px = 0.0}, 1.0).geometry.left;
  const LensResidual residual = draw_lens_residual(eye, 0.03, 4);
  // Derivatives of Eye::project by finite differences: lens, and the turn of the camera.
  std::vector<Vector3d> points;
  for (int v = 20; v < 960; v += 40) {
    for (int u = 20; u < 1280; u += 40) points.push_back(eye.eye_from_turntable.inverse() * (600.0 * eye.ray(u, v)));
  }
  const auto pixels = [&](const Eye& e) {
    Eigen::VectorXd all(2 * points.size());
    for (std::size_t i = 0; i < points.size(); ++i) all.segment<2>(2 * i) = e.project(points[i]);
    return all;
  };
  const Eigen::VectorXd brown = pixels(eye);
  Eye bent = eye;
  bent.residual = residual;
  const Eigen::VectorXd off = pixels(bent) - brown;
  Eigen::MatrixXd model(off.size(), 12);
  for (int i = 0; i < 12; ++i) {
    Eye changed = eye;
    if (i < 5) changed.distortion[i] += 1e-4;
    if (i == 5) changed.fx += 0.1;
    if (i == 6) changed.fy += 0.1;
    if (i == 7) changed.cx += 0.1;
    if (i == 8) changed.cy += 0.1;
    if (i > 8) {
      changed.eye_from_turntable =
          small_motion(1e-5 * Vector3d::Unit(i - 9), Vector3d::Zero()) * eye.eye_from_turntable;
    }
    model.col(i) = (pixels(changed) - brown).normalized();
  }
  const Eigen::VectorXd rest = off - model * model.colPivHouseholderQr().solve(off);
  const double count = static_cast<double>(points.size());
  EXPECT_NEAR(off.norm() / std::sqrt(count), 0.03, 0.002);
  EXPECT_NEAR(rest.norm() / std::sqrt(count), 0.03, 0.002);
}

TEST(Eye, WithALensResidualLeadsBackToThePixel) {
  const Eye eye = draw_rig({.residual_px = 0.5}, 1.0).geometry.right;
  const RayMap map(eye);
  for (const double u : {0.0, 640.25, 1279.0}) {
    for (const double v : {0.0, 480.6, 959.0}) {
      const Transform turntable_from_eye = eye.eye_from_turntable.inverse();
      EXPECT_LT((eye.project(turntable_from_eye * (600.0 * eye.ray(u, v))) - Vector2d(u, v)).norm(), 1e-6);
      EXPECT_LT((eye.project(turntable_from_eye * (600.0 * map.ray(u, v))) - Vector2d(u, v)).norm(), 2e-5);
    }
  }
}

TEST(NamedValues, AreSetByNameAndRefuseOthers) {
  RigVariation rig;
  ASSERT_TRUE(set_by_name(rig, kRigVariationNames, "residual=0.1,lenses=0,swapped"));
  EXPECT_EQ(rig.residual_px, 0.1);
  EXPECT_EQ(rig.lenses, 0.0);
  EXPECT_EQ(rig.swapped, 1.0);
  EXPECT_EQ(set_by_name(rig, kRigVariationNames, "lens=1").error().code, ErrorCode::not_found);
  EXPECT_EQ(set_by_name(rig, kRigVariationNames, "gear=fast").error().code, ErrorCode::invalid_input);
}

TEST(Scene, OfADrawnRigHasItsObjectWhereTheTruthSays) {
  // The top of a box's corner edge, against the brightest change: the silhouette's extent to a pixel.
  SceneOptions options;
  options.image_scale = 0.5, options.noise = false;
  options.rig = RigVariation{.seed = 4, .top_tilt_deg = 0.5};
  const Transform placement(Eigen::Translation3d(5.0, 20.0, -4.0));
  Scene scene(grey(box({20.0, 20.0, 20.0}), 0.8F), {placement}, options);
  const double angle = scene.drawn_rig().table.true_deg(30.0) * M_PI / 180.0;
  const cv::Mat raw = scene.shoot(0, angle, false, 1).left;
  const Transform turntable_from_object = rot_y(angle) * scene.true_placement(0);
  double left = 1e9, right = -1e9;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner(i & 1 ? 20.0 : -20.0, i & 2 ? 20.0 : -20.0, i & 4 ? 20.0 : -20.0);
    const Vector2d at = scene.rig().left.project(turntable_from_object * corner);
    left = std::min(left, at.x()), right = std::max(right, at.x());
  }
  // Red pixels: the object is bright in red, table and cloth are not.
  int first = 1 << 20, last = -1;
  for (int y = 0; y < raw.rows; y += 2) {
    for (int x = 0; x < raw.cols; x += 2) {
      if (raw.at<std::uint8_t>(y, x) > 50) first = std::min(first, x), last = std::max(last, x);
    }
  }
  EXPECT_NEAR(first, left, 2.5);
  EXPECT_NEAR(last, right, 2.5);
}

}  // namespace
}  // namespace scanrig::sim
