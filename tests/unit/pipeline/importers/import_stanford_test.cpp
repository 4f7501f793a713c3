#include "pipeline/importers/import_stanford.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "core/units.h"
#include "tests/shared_data.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using namespace scan_samples;

constexpr double kRadius = 20.0;                    // of the scanned ball, mm
const Eigen::Vector3d kAxisPoint(3.0, 0.0, -15.0);  // in the scanner's frame
const Eigen::Vector3d kAxis = Eigen::Vector3d(0.01, 1.0, -0.02).normalized();
const Eigen::Vector3d kBall(12.0, 70.0, 4.0);  // its centre in the scanner's frame before the table turns
const std::vector<double> kAngles = {0.0, 24.0, 48.0, 290.0};

Transform table_turned(double degrees) {
  Transform turn = Transform::Identity();
  turn.translate(kAxisPoint).rotate(Eigen::AngleAxisd(to_radians(degrees), kAxis)).translate(-kAxisPoint);
  return turn;
}

/// The view of a ball by a scanner whose rays run along (-0.5, 0, -1), as an ASCII PLY range grid in metres.
std::string scan_of_ball(const Eigen::Vector3d& centre) {
  const Eigen::Vector3d ray = Eigen::Vector3d(-0.5, 0.0, -1.0).normalized();
  const int cols = 120, rows = 90;
  std::string points, cells;
  int count = 0;
  const int middle = cols / 2;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const Eigen::Vector3d start(0.577 * (col - middle), 0.71 * row + 40.0, 0.0);
      const double along = (centre - start).dot(ray);
      const double off = (centre - start - along * ray).norm();
      if (off > 0.97 * kRadius) {
        cells += "0\n";
        continue;
      }
      const Eigen::Vector3d p = 1e-3 * (start + (along - std::sqrt(kRadius * kRadius - off * off)) * ray);
      points += fmt::format("{:.9f} {:.9f} {:.9f}\n", p.x(), p.y(), p.z());
      cells += fmt::format("1 {}\n", count++);
    }
  }
  return fmt::format(
             "ply\nformat ascii 1.0\nobj_info num_cols {}\nobj_info num_rows {}\nelement vertex {}\n"
             "property float x\nproperty float y\nproperty float z\nelement range_grid {}\n"
             "property list uchar int vertex_indices\nend_header\n",
             cols, rows, count, cols * rows) +
         points + cells;
}

class ImportStanfordTest : public FolderTest {
 protected:
  /// A .conf whose world is `world_from_scanner` away from the scanner.
  std::filesystem::path write_conf(const std::string& name, const Transform& world_from_scanner) {
    std::string conf = "camera 0 -0.1 -0.7 0 1 0 0\nmesh merged.ply 0 0 0 0 0 0 1\n";
    for (const double angle : kAngles) {
      const Transform world_from_scan = world_from_scanner * table_turned(-angle);
      const Eigen::Quaterniond q(Eigen::Matrix3d(world_from_scan.linear().transpose()));
      const Eigen::Vector3d t = 1e-3 * world_from_scan.translation();
      conf += fmt::format("bmesh ball_{}.ply {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", angle, t.x(),
                          t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
      write_text(folder_ / fmt::format("ball_{}.ply", angle), scan_of_ball(table_turned(angle) * kBall));
    }
    write_text(folder_ / name, conf);
    return folder_ / name;
  }
  void expect_refused(const std::filesystem::path& conf, ErrorCode code, const std::string& name) {
    const auto imported = import_stanford(conf, std::nullopt, folder_ / "out");
    ASSERT_FALSE(imported);
    EXPECT_EQ(imported.error().code, code) << imported.error().message;
    EXPECT_NE(imported.error().message.find(name), std::string::npos) << imported.error().message;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
};

TEST_F(ImportStanfordTest, EveryViewSeesTheBallAtItsPlaceOnTheTable) {
  const auto conf = write_conf("ball.conf", Transform::Identity());
  const auto imported = import_stanford(conf, std::nullopt, folder_ / "out");
  ASSERT_TRUE(imported) << imported.error().message;
  const auto scan = ScanFolder::open(folder_ / "out");
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->manifest().state, "scanned");
  // From the axis, and its component along it: the expected place of the ball except the height of the lowest point.
  const Eigen::Vector3d offset = kBall - kAxisPoint;
  const double from_axis = (offset - offset.dot(kAxis) * kAxis).norm();
  const auto& views = scan->manifest().poses.at(0).views;
  ASSERT_EQ(views.size(), kAngles.size());
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_NEAR(views[i].measured_deg, kAngles[i], 1e-6);
    const auto range = scan->load_range(0, i);
    ASSERT_TRUE(range) << range.error().message;
    // The sphere through the points, by linear least squares.
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    std::vector<Eigen::Vector3d> points;
    for (int r = 0; r < range->depth.rows; ++r) {
      for (int c = 0; c < range->depth.cols; ++c) {
        if (std::isnan(range->depth(r, c))) continue;
        points.push_back(range->camera_from_pose.inverse() * range->projection.unproject(c, r, range->depth(r, c)));
        const Eigen::Vector4d basis = 2.0 * points.back().homogeneous();
        normal += basis * basis.transpose();
        right += basis * points.back().squaredNorm();
      }
    }
    ASSERT_GT(points.size(), 2000u);
    const Eigen::Vector4d fit = normal.ldlt().solve(right);
    if (i == 0) {
      centre = fit.head<3>();
      EXPECT_NEAR(std::hypot(centre.x(), centre.z()), from_axis, 0.02);
      EXPECT_NEAR(centre.y(), 0.97 * kRadius, 0.6) << "the lowest cells seen are at y = 0";
    }
    EXPECT_LT((fit.head<3>() - centre).norm(), 0.02) << "view " << i;
    for (const auto& p : points) EXPECT_NEAR((p - centre).norm(), kRadius, 0.06);
  }
}

// The second pose's file may be given in the first one's frame; that must not survive.
TEST_F(ImportStanfordTest, TheFramesOfTheFilesLeaveNoTrace) {
  Transform far = Transform::Identity();
  far.translate(Eigen::Vector3d(-150, 1110, 320))
      .rotate(Eigen::AngleAxisd(1.9, Eigen::Vector3d(1, -2, 0.5).normalized()));
  const auto here = write_conf("here.conf", Transform::Identity());
  const auto there = write_conf("there.conf", far);
  ASSERT_TRUE(import_stanford(here, there, folder_ / "out"));
  const auto scan = ScanFolder::open(folder_ / "out").value();
  ASSERT_EQ(scan.manifest().poses.size(), 2u);
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    const ViewRecord& a = scan.manifest().poses[0].views[i];
    const ViewRecord& b = scan.manifest().poses[1].views[i];
    EXPECT_LT((a.camera_from_pose.matrix() - b.camera_from_pose.matrix()).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_NEAR(a.measured_deg, b.measured_deg, 1e-9);
    EXPECT_EQ(a.files.at("range").sha256, b.files.at("range").sha256);
    EXPECT_EQ(a.grid->fx, b.grid->fx);
  }
}

TEST_F(ImportStanfordTest, AnExistingFolderIsNotTouched) {
  const auto conf = write_conf("ball.conf", Transform::Identity());
  std::filesystem::create_directories(folder_ / "out" / "precious");
  EXPECT_EQ(import_stanford(conf, std::nullopt, folder_ / "out").error().code, ErrorCode::exists);
}

TEST_F(ImportStanfordTest, DefectsOfTheFilesAreNamed) {
  const auto conf = write_conf("ball.conf", Transform::Identity());
  expect_refused(folder_ / "absent.conf", ErrorCode::not_found, "absent.conf");
  write_text(folder_ / "empty.conf", "camera 0 0 0 0 0 0 1\n");
  expect_refused(folder_ / "empty.conf", ErrorCode::invalid_input, "empty.conf");
  write_text(folder_ / "short.conf", "bmesh ball_0.ply 0 0 0 0 0 1\n");
  expect_refused(folder_ / "short.conf", ErrorCode::invalid_input, "short.conf:1");
  write_text(folder_ / "one.conf", "bmesh ball_0.ply 0 0 0 0 0 0 1\n");
  expect_refused(folder_ / "one.conf", ErrorCode::degenerate, "one.conf");
  write_text(folder_ / "tumbling.conf",
             "bmesh ball_0.ply 0 0 0 0 0 0 1\nbmesh ball_24.ply 0 0 0 1 0 0 0\nbmesh ball_48.ply 0 0 0 0 1 0 0\n");
  expect_refused(folder_ / "tumbling.conf", ErrorCode::degenerate, "one axis");
  const std::string ply = read_file(folder_ / "ball_24.ply").value();
  write_text(folder_ / "ball_24.ply", ply.substr(0, ply.size() / 2));
  expect_refused(conf, ErrorCode::invalid_input, "ball_24.ply");
  write_text(folder_ / "ball_24.ply", replaced(ply, "ascii", "binary_little_endian"));
  expect_refused(conf, ErrorCode::unsupported, "ball_24.ply");
  std::filesystem::remove(folder_ / "ball_24.ply");
  expect_refused(conf, ErrorCode::not_found, "ball_24.ply");
}

// Stanford's dragon: 15 scans upright, 6 lying. Neighbouring scans must lie on one surface to their own noise.
TEST_F(ImportStanfordTest, TheDragonsScansFitTogether) {
  const auto dragon = shared_data() / "stanford_dragon";
  if (!std::filesystem::exists(dragon)) GTEST_SKIP() << dragon << " is missing";
  const auto imported = import_stanford(dragon / "stand/dragonStandRight.conf",
                                        dragon / "side/dragonSideRight_ESTIMATED.conf", folder_ / "out");
  ASSERT_TRUE(imported) << imported.error().message;
  const auto scan = ScanFolder::open(folder_ / "out").value();
  ASSERT_EQ(scan.manifest().poses.at(0).views.size(), 15u);
  ASSERT_EQ(scan.manifest().poses.at(1).views.size(), 6u);
  for (const std::size_t pose : {0u, 1u}) {
    const double step = scan.manifest().poses[pose].views[1].measured_deg - 360.0;
    EXPECT_NEAR(step, -24.0, 0.5);
    const RangeImage a = scan.load_range(pose, 0).value(), b = scan.load_range(pose, 1).value();
    std::vector<double> off;
    const Transform b_from_a = b.camera_from_pose * a.camera_from_pose.inverse();
    for (int r = 0; r < a.depth.rows; ++r) {
      for (int c = 0; c < a.depth.cols; ++c) {
        if (std::isnan(a.depth(r, c))) continue;
        const Eigen::Vector3d p = b_from_a * a.projection.unproject(c, r, a.depth(r, c));
        const Eigen::Vector2i px = b.projection.project(p).array().round().cast<int>();
        if (!b.projection.contains(px.cast<double>()) || std::isnan(b.depth(px.y(), px.x()))) continue;
        const cv::Vec3f n = b.normal(px.y(), px.x());
        const double d =
            Eigen::Vector3d(n[0], n[1], n[2]).dot(p - b.projection.unproject(px.x(), px.y(), b.depth(px.y(), px.x())));
        if (std::abs(d) < 3.0) off.push_back(std::abs(d));
      }
    }
    ASSERT_GT(off.size(), 10000u);
    std::nth_element(off.begin(), off.begin() + off.size() / 2, off.end());
    EXPECT_LT(off[off.size() / 2], 0.15);
  }
}

}  // namespace
}  // namespace scanrig
