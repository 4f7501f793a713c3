#include "pipeline/importers/import_stanford.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/units.h"
#include "pipeline/importers/grid_resampling.h"
#include "pipeline/importers/stanford_files.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {
namespace {

/// The scans of one pose, all taken by a scanner at rest.
struct TurntableSet {
  std::vector<RangeGrid> grids;
  std::vector<Transform> scan0_from_scan;
};

Result<TurntableSet> read_set(const std::filesystem::path& conf) {
  const auto scans = read_stanford_conf(conf);
  if (!scans) return pass_on(scans);
  TurntableSet set;
  for (const PlacedScan& scan : *scans) {
    auto grid = read_range_grid(scan.file);
    if (!grid) return pass_on(grid);
    set.grids.push_back(std::move(*grid));
    set.scan0_from_scan.push_back(scans->front().world_from_scan.inverse() * scan.world_from_scan);
  }
  return set;
}

struct Axis {
  Eigen::Vector3d direction;  ///< unit, up
  Eigen::Vector3d point;
};

/// The axis in the scanner's frame. For every pair of scans, the motion (R, t) between them turns about it: R a = a,
/// and R c + t = c except for rounding along a. Both in the least-squares sense over all pairs.
Result<Axis> turntable_axis(const TurntableSet& set) {
  std::vector<Transform> motions;
  Eigen::Matrix3d turning = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < set.scan0_from_scan.size(); ++i) {
    for (std::size_t j = i + 1; j < set.scan0_from_scan.size(); ++j) {
      motions.push_back(set.scan0_from_scan[i].inverse() * set.scan0_from_scan[j]);
      const Eigen::Matrix3d change = motions.back().linear() - Eigen::Matrix3d::Identity();
      turning += change.transpose() * change;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(turning);
  const Eigen::Vector3d spread = solver.eigenvalues() / std::max<double>(1.0, static_cast<double>(motions.size()));
  // A turn of 5 degrees gives 0.0076 across the axis; a wobble of 2 degrees 0.0012 along it.
  if (spread[1] < 0.0076 || spread[0] > 0.0012) {
    return fail(ErrorCode::degenerate, "the scans do not turn about one axis");
  }
  Eigen::Vector3d direction = solver.eigenvectors().col(0);
  if (direction.y() < 0.0) direction = -direction;
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
  Eigen::Matrix3d normal = direction * direction.transpose();  // the point nearest the origin
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Transform& motion : motions) {
    const Eigen::Matrix3d change = across * (motion.linear() - Eigen::Matrix3d::Identity());
    normal += change.transpose() * change;
    right -= change.transpose() * across * motion.translation();
  }
  return Axis{direction, normal.ldlt().solve(right)};
}

/// The pose's frame except its height: origin on the axis, +Y along it, the scanner's +Z without its axial component.
Transform pose_from_scan0(const Axis& axis) {
  Eigen::Matrix3d rows;
  const Eigen::Vector3d x = axis.direction.cross(Eigen::Vector3d::UnitZ()).normalized();
  rows << x.transpose(), axis.direction.transpose(), x.cross(axis.direction).transpose();
  Transform transform = Transform::Identity();
  transform.linear() = rows;
  transform.translation() = -(rows * axis.point);
  return transform;
}

double base_height(const TurntableSet& set, const Transform& pose_from_scan0) {
  std::vector<double> heights;
  for (std::size_t i = 0; i < set.grids.size(); ++i) {
    const Transform pose_from_scan = pose_from_scan0 * set.scan0_from_scan[i];
    for (const auto& p : set.grids[i].points) heights.push_back((pose_from_scan * p).y());
  }
  if (heights.empty()) return 0.0;
  const auto lowest = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 1000);
  std::nth_element(heights.begin(), lowest, heights.end());
  return *lowest;
}

/// Table angle, 0..360 degrees: at angle theta the scanner sees the object's X at Rot_y(theta) X.
double table_angle_deg(const Transform& scan_from_scan0, const Transform& pose_from_scan0) {
  const Eigen::Matrix3d turn = (pose_from_scan0 * scan_from_scan0 * pose_from_scan0.inverse()).linear();
  const double angle = to_degrees(std::atan2(turn(0, 2) - turn(2, 0), turn(0, 0) + turn(2, 2)));
  if (std::abs(angle) < 1e-9) return 0.0;
  return angle < 0.0 ? angle + 360.0 : angle;
}

struct PlacedView {
  ViewRecord record;
  cv::Mat1f depth;
};

Result<std::vector<PlacedView>> views_of_pose(const std::filesystem::path& conf) {
  const auto set = read_set(conf);
  if (!set) return pass_on(set);
  const auto axis = turntable_axis(*set);
  if (!axis) return pass_on(axis, conf.string());
  Transform pose_from_first = pose_from_scan0(*axis);
  pose_from_first.pretranslate(Eigen::Vector3d(0.0, -base_height(*set, pose_from_first), 0.0));
  std::vector<PlacedView> views;
  for (std::size_t i = 0; i < set->grids.size(); ++i) {
    const auto resampled = resample(set->grids[i]);
    if (!resampled) return pass_on(resampled, fmt::format("{}: scan {}", conf.string(), i));
    ViewRecord view;
    view.index = static_cast<int>(i);
    view.measured_deg = table_angle_deg(set->scan0_from_scan[i].inverse(), pose_from_first);
    view.commanded_deg = view.measured_deg;
    view.grid = resampled->grid;
    view.camera_from_pose = resampled->camera_from_scan * (pose_from_first * set->scan0_from_scan[i]).inverse();
    views.push_back({std::move(view), resampled->depth});
  }
  return views;
}

}  // namespace

Result<void> import_stanford(const std::filesystem::path& pose1_conf,
                             const std::optional<std::filesystem::path>& pose2_conf,
                             const std::filesystem::path& out_folder) {
  std::vector<std::filesystem::path> confs{pose1_conf};
  if (pose2_conf) confs.push_back(*pose2_conf);
  std::vector<std::vector<PlacedView>> poses;
  for (const auto& conf : confs) {
    auto views = views_of_pose(conf);
    if (!views) return pass_on(views);
    poses.push_back(std::move(*views));
  }
  Manifest manifest;
  manifest.id = out_folder.filename().string();
  manifest.source = "range";
  auto scan = ScanFolder::create(out_folder, manifest, {});
  if (!scan) return pass_on(scan);
  for (std::size_t pose = 0; pose < poses.size(); ++pose) {
    for (PlacedView& view : poses[pose]) {
      if (auto added = scan->add_range_view(pose, std::move(view.record), view.depth); !added) return added;
    }
    const bool last = pose + 1 == poses.size();
    if (auto complete = scan->complete_pose(pose, last ? "scanned" : "scanning"); !complete) return complete;
  }
  return {};
}

}  // namespace scanrig
