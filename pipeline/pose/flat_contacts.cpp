#include "pipeline/pose/flat_contacts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/statistics.h"
#include "pipeline/pose/rest_pairs.h"

namespace scanrig {
namespace {

constexpr double kReach = 0.015;         // of the object's size
constexpr double kFacing = 0.9976;       // cosine to the vertical: 4 deg
constexpr double kNearlyFacing = 0.978;  // 12 deg
constexpr double kFlatShare = 0.7;       // of what faces nearly so; a cylinder has a third
constexpr double kFlatMm = 0.15;         // half the height of what counts as one plane
constexpr std::size_t kMinFlat = 100;    // samples, of some 20000
constexpr double kMaxBelow = 0.001;      // share of the samples that may be lower

/// The middle of the flat surface of `samples` that lies lowest, as `to_table` carries it onto a table y = 0.
std::optional<Eigen::Vector3d> lowest_flat(const std::vector<SurfacePoint>& samples, const Transform& to_table,
                                           double reach_mm) {
  std::vector<Eigen::Vector3d> facing;
  std::vector<double> heights;
  std::size_t nearly = 0;
  for (const SurfacePoint& sample : samples) {
    const Eigen::Vector3d point = to_table * sample.point;
    const double down = -(to_table.linear() * sample.normal).y();
    if (std::abs(point.y()) > reach_mm || down < kNearlyFacing) continue;
    ++nearly;
    if (down < kFacing) continue;
    facing.push_back(point);
    heights.push_back(point.y());
  }
  const bool is_round = static_cast<double>(facing.size()) < kFlatShare * static_cast<double>(nearly);
  if (is_round || facing.size() < kMinFlat) return std::nullopt;
  const double lowest = quantile(std::move(heights), 0.05);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::vector<double> flat;
  for (const Eigen::Vector3d& point : facing) {
    if (std::abs(point.y() - lowest) > kFlatMm) continue;
    flat.push_back(point.y());
    middle += point;
  }
  const auto below = std::ranges::count_if(
      samples, [&](const SurfacePoint& sample) { return (to_table * sample.point).y() < lowest - kFlatMm; });
  if (flat.size() < kMinFlat || static_cast<double>(below) > kMaxBelow * static_cast<double>(samples.size())) {
    return std::nullopt;
  }
  middle /= static_cast<double>(flat.size());
  middle.y() = quantile(std::move(flat), 0.5);
  return middle;
}

}  // namespace

std::vector<Contact> flat_contacts(const MeasuredPose& pose1, const MeasuredPose& pose2,
                                   const Transform& pose1_from_pose2) {
  const double reach_mm = kReach * pose1.size_mm;
  const Transform pose2_from_pose1 = pose1_from_pose2.inverse();
  std::vector<Contact> contacts;
  if (const auto of_pose2 = lowest_flat(pose2.samples.front(), pose1_from_pose2, reach_mm)) {
    contacts.push_back({pose2_from_pose1 * *of_pose2, base_normal(), 0.0, /*is_flat=*/true});
  }
  if (const auto of_pose1 = lowest_flat(pose1.samples.front(), pose2_from_pose1, reach_mm)) {
    const Eigen::Vector3d normal = pose1_from_pose2.linear() * base_normal();
    const Eigen::Vector3d on_table(of_pose1->x(), 0.0, of_pose1->z());
    contacts.push_back({on_table, normal, normal.dot(pose1_from_pose2 * *of_pose1), /*is_flat=*/true});
  }
  return contacts;
}

}  // namespace scanrig
