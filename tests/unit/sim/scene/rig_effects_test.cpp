#include "sim/scene/rig_effects.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "core/units.h"
#include "sim/scene/renderer.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Effects mechanics(std::string_view without = "") {
  std::string names = "optics,sensor,projector,materials,drift,room,";
  return choose_effects("workshop", names + std::string(without), "").value();
}

/// Renders the table's rim near (0, 0, 84.5), where a rim dot comes past every 9 degrees.
class RimWatch {
 public:
  RimWatch() : far_(grey(box({0.5, 0.5, 0.5}), 0.5F)), rays_(far_.mesh), light_(far_, rays_, away_) {}

  /// Where the dot is in the left image when the table is at `angle` (radians) and in truth moves as `table` says.
  [[nodiscard]] Vector2d dot_at(const DrawnRig& rig, double angle) const {
    const RigGeometry seen = rig.table.is_ideal() ? rig.geometry : against_table_motion(rig.geometry, rig.table, angle);
    Eye window = seen.left;
    const Vector2d about = rig.geometry.left.project({0.0, 0.0, profile().rim_dot_radius_mm});
    const int x0 = static_cast<int>(about.x()) - 32, y0 = static_cast<int>(about.y()) - 20;
    window.cx -= x0, window.cy -= y0, window.width = 64, window.height = 40;
    const Placed placed{far_, rays_, light_, away_, rig.rim_dots};
    const cv::Mat plain = render(placed, window, seen.projector, dots_, angle).plain;
    double sum = 0.0;
    Vector2d centre = Vector2d::Zero();
    for (int y = 0; y < plain.rows; ++y) {
      for (int x = 0; x < plain.cols; ++x) {
        const double light = std::max(0.0F, plain.at<cv::Vec3f>(y, x)[0] - plain.at<cv::Vec3f>(0, 0)[0] * 1.3F);
        sum += light, centre += light * Vector2d(x + x0, y + y0);
      }
    }
    return centre / sum;
  }

 private:
  const Transform away_{Eigen::Translation3d(0.0, 1000.0, -400.0)};
  Object far_;
  RayCaster rays_;
  RoomLight light_;
  DotPattern dots_{0.25};
};

TEST(Turntable, RunsOutInTwoHarmonicsThatRenderedMarksShow) {
  const Effects effects = mechanics("wobble,worm,tilt,height");
  const DrawnRig moved = make_rig({}, effects, 1.0), ideal = make_rig({}, {}, 1.0);
  ASSERT_TRUE(ideal.table.is_ideal());
  const RimWatch watch;
  constexpr int kAngles = 20;
  Eigen::MatrixXd harmonics(kAngles, 5), seen(kAngles, 1);
  for (int i = 0; i < kAngles; ++i) {
    const double angle = 2.0 * M_PI * i / kAngles;
    const Vector2d off = watch.dot_at(moved, angle) - watch.dot_at(ideal, angle);
    harmonics.row(i) << 1.0, std::cos(angle), std::sin(angle), std::cos(2.0 * angle), std::sin(2.0 * angle);
    seen(i, 0) = off.x();  // the image's x is the rig's x
  }
  const Eigen::VectorXd fit = harmonics.colPivHouseholderQr().solve(seen);
  const double px_per_mm = ideal.geometry.left.fx /
                           (ideal.geometry.left.eye_from_turntable * Vector3d(0.0, 0.0, 84.5)).z() *
                           std::cos(std::asin(80.0 / 640.0));
  EXPECT_NEAR(std::hypot(fit[1], fit[2]) / px_per_mm, 0.8 * 0.010, 0.0012);
  EXPECT_NEAR(std::hypot(fit[3], fit[4]) / px_per_mm, 0.6 * 0.010, 0.0012);
  EXPECT_LT((seen - harmonics * fit).cwiseAbs().maxCoeff(), 0.02);
}

TEST(Turntable, WobblesAboutBothAxes) {
  const AxisErrors axis = make_rig({}, mechanics("runout,worm,tilt,height"), 1.0).table.axis;
  double about_x = 0.0, about_z = 0.0;
  for (int deg = 0; deg < 360; ++deg) {
    const Eigen::Matrix3d turn = axis.motion(to_radians(deg)).linear();
    EXPECT_TRUE(axis.motion(to_radians(deg)).translation().isZero());
    about_x += std::pow(to_degrees(turn(2, 1)), 2.0), about_z += std::pow(to_degrees(turn(1, 0)), 2.0);
  }
  EXPECT_NEAR(std::sqrt(2.0 * about_x / 360.0), 0.003, 1e-5);
  EXPECT_NEAR(std::sqrt(2.0 * about_z / 360.0), 0.003, 1e-5);
}

TEST(Turntable, HasTheErrorOfItsWorm) {
  const TableErrors table = make_rig({}, mechanics("runout,wobble,tilt,height"), 1.0).table;
  double highest = 0.0;
  for (int i = 0; i < 400; ++i) highest = std::max(highest, std::abs(table.true_deg(0.1 * i) - 0.1 * i));
  EXPECT_NEAR(highest, 0.01, 1e-4);
  EXPECT_NEAR(table.true_deg(13.0) - 13.0, table.true_deg(17.0) - 17.0, 1e-9);
  EXPECT_GT(std::abs((table.true_deg(13.0) - 13.0) - (table.true_deg(15.0) - 15.0)), 0.004);
}

TEST(Turntable, CarriesATopThatIsTilted) {
  const TableErrors table = make_rig({}, mechanics("runout,wobble,worm"), 1.0).table;
  const double tilt = std::acos(table.axis_from_top.linear().col(1).y());
  EXPECT_NEAR(to_degrees(tilt), 0.02, 1e-6);
  EXPECT_TRUE(make_rig({}, mechanics("turntable"), 1.0).table.is_ideal());
}

TEST(Cameras, DriftWhileTheyWarm) {
  const Effects drift = choose_effects("workshop", "optics,sensor,projector,materials,turntable,room", "").value();
  const RigGeometry warm = make_rig({}, drift, 1.0).geometry;
  const auto relative = [&](double minutes) {
    const RigGeometry then = at_time(warm, drift, {minutes});
    const Vector3d aim(0.0, 45.0, 0.0);
    const Vector2d left = then.left.project(aim) - warm.left.project(aim),
                   right = then.right.project(aim) - warm.right.project(aim);
    const double grown = (then.left.centre() - then.right.centre()).norm() - 160.0;
    // What the shorter baseline shifts at that distance is not part of the turn.
    return std::pair((right - left - Vector2d(-warm.left.fx * grown / 645.0, 0.0)).norm(), grown);
  };
  EXPECT_NEAR(relative(0.0).first, 0.1, 0.003);
  EXPECT_NEAR(relative(0.0).second, -0.010, 1e-6);
  EXPECT_NEAR(relative(10.0).second, -0.010 / std::exp(1.0), 1e-6);
  EXPECT_NEAR(relative(30.0).first, 0.005, 0.001);
  EXPECT_EQ(at_time(warm, drift, {}).left.eye_from_turntable.matrix(), warm.left.eye_from_turntable.matrix());
}

TEST(Lenses, FocusApartAndBendMoreThanFiveCoefficients) {
  const Effects optics = choose_effects("workshop", "sensor,projector,materials,turntable,drift,room", "").value();
  const RigGeometry rig = make_rig({}, optics, 1.0).geometry, plain = make_rig({}, {}, 1.0).geometry;
  EXPECT_EQ(rig.right.focus_off_mm - rig.left.focus_off_mm, 4.0);
  double squares = 0.0;
  int count = 0;
  for (double x = -100.0; x <= 100.0; x += 20.0) {
    for (double y = -20.0; y <= 110.0; y += 13.0, ++count)
      squares += (rig.left.project({x, y, 0.0}) - plain.left.project({x, y, 0.0})).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(0.5 * squares / count), 0.05, 0.025);
  ASSERT_TRUE(rig.right.residual);
  EXPECT_NE(rig.left.residual->du, rig.right.residual->du);
}

}  // namespace
}  // namespace scanrig::sim
