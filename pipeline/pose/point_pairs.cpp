#include "pipeline/pose/point_pairs.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig {
namespace {

int angle_step(double cosine, int steps) {
  const double share = std::acos(std::clamp(cosine, -1.0, 1.0)) / std::numbers::pi;
  return std::min(static_cast<int>(share * steps), steps - 1);
}

/// Key of a pair of oriented points, or -1 where its distance is not used.
int key_of(const SurfacePoint& a, const SurfacePoint& b, double size_mm, const PointPairOptions& options) {
  const Eigen::Vector3d d = b.point - a.point;
  const double length = d.norm();
  const double share = (length / size_mm - options.min_length) / (options.max_length - options.min_length);
  if (share < 0.0 || share >= 1.0) return -1;
  const Eigen::Vector3d u = d / length;
  int key = static_cast<int>(share * options.distance_steps);
  key = key * options.angle_steps + angle_step(a.normal.dot(u), options.angle_steps);
  key = key * options.angle_steps + angle_step(b.normal.dot(u), options.angle_steps);
  return key * options.angle_steps + angle_step(a.normal.dot(b.normal), options.angle_steps);
}

/// The frame of an oriented point: itself at the origin, its normal along x.
Transform local_from_surface(const SurfacePoint& p) {
  Transform t = Transform::Identity();
  Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(p.normal, Eigen::Vector3d::UnitX());
  if (std::abs(turn.squaredNorm() - 1.0) > 1e-9) turn.normalize();  // digits cancel for a normal close to -x
  t.linear() = turn.toRotationMatrix();
  t.translation() = -t.linear() * p.point;
  return t;
}

/// Angle of `p` about the normal of the oriented point.
double turn_of(const Transform& local, const Eigen::Vector3d& p) {
  const Eigen::Vector3d q = local * p;
  return std::atan2(q.z(), q.y());
}

bool alike(const Transform& a, const Transform& b, const Eigen::Vector3d& middle, double size_mm,
           const PointPairOptions& options) {
  return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(options.same_deg) &&
         (a * middle - b * middle).norm() < options.same_shift * size_mm;
}

}  // namespace

PointPairTable::PointPairTable(std::span<const SurfacePoint> surface1, double size_mm, const PointPairOptions& options)
    : options_(options), size_mm_(size_mm) {
  const int keys_used = options.distance_steps * options.angle_steps * options.angle_steps * options.angle_steps;
  const std::size_t count = surface1.size();
  local_.resize(count);
  std::vector<std::int32_t> keys(count * count, -1);
  parallel_for(count, [&](std::size_t i) {
    local_[i] = local_from_surface(surface1[i]);
    for (std::size_t j = 0; j < count; ++j) keys[i * count + j] = key_of(surface1[i], surface1[j], size_mm, options);
  });
  begin_.assign(keys_used + 1, 0);
  for (const std::int32_t key : keys) {
    if (key >= 0) ++begin_[key + 1];
  }
  for (int k = 0; k < keys_used; ++k) begin_[k + 1] += begin_[k];
  entries_.resize(begin_[keys_used]);
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      const std::int32_t key = keys[i * count + j];
      if (key < 0) continue;
      const auto turn = static_cast<float>(turn_of(local_[i], surface1[j].point));
      entries_[next[key]++] = {static_cast<std::uint32_t>(i), turn};
    }
  }
}

/// The motions with most votes of the pairs that start at one point of surface 2.
std::vector<Vote> PointPairTable::votes_of(std::span<const SurfacePoint> surface2, std::size_t reference) const {
  const int turn_steps = options_.turn_steps;
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  const Transform local2 = local_from_surface(surface2[reference]);
  std::vector<float> votes(local_.size() * turn_steps, 0.0F);
  for (const SurfacePoint& other : surface2) {
    const int key = key_of(surface2[reference], other, size_mm_, options_);
    if (key < 0) continue;
    const double turn2 = turn_of(local2, other.point);
    // A common key (flat faces have them) carries little information: its votes count less, and a part of its pairs is
    // enough.
    const std::uint32_t alike = begin_[key + 1] - begin_[key];
    const float weight = 1.0F / std::sqrt(static_cast<float>(alike) + 1.0F);
    for (std::uint32_t e = begin_[key]; e < begin_[key + 1]; e += 1 + alike / options_.max_alike) {
      const double turn = (entries_[e].turn - turn2) / kTwoPi;
      const int step = static_cast<int>((turn - std::floor(turn)) * turn_steps) % turn_steps;
      votes[entries_[e].reference * turn_steps + step] += weight;
    }
  }
  std::vector<Vote> peaks;
  for (std::size_t peak = 0; peak < options_.peaks; ++peak) {
    const auto best = std::max_element(votes.begin(), votes.end());
    const auto cell = static_cast<std::size_t>(best - votes.begin());
    const double turn = kTwoPi * (static_cast<double>(cell % turn_steps) + 0.5) / turn_steps;
    const Eigen::AngleAxisd about_normal(turn, Eigen::Vector3d::UnitX());
    peaks.push_back({local_[cell / turn_steps].inverse() * about_normal * local2, *best});
    *best = 0.0F;
  }
  return peaks;
}

std::vector<Vote> PointPairTable::vote(std::span<const SurfacePoint> surface2, int max_motions) const {
  if (local_.empty() || surface2.empty()) return {};
  const std::size_t stride = std::max<std::size_t>(1, surface2.size() / options_.references);
  std::vector<std::vector<Vote>> parts((surface2.size() + stride - 1) / stride);
  parallel_for(parts.size(), [&](std::size_t k) { parts[k] = votes_of(surface2, k * stride); });

  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const SurfacePoint& p : surface2) middle += p.point / static_cast<double>(surface2.size());
  std::vector<Vote> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  // Votes of different points of surface 2 must give the same motion: add up the votes of similar ones.
  std::vector<Vote> summed = all;
  parallel_for(all.size(), [&](std::size_t i) {
    summed[i].votes = 0.0;
    for (const Vote& v : all) {
      if (alike(all[i].pose1_from_pose2, v.pose1_from_pose2, middle, size_mm_, options_)) summed[i].votes += v.votes;
    }
  });
  std::stable_sort(summed.begin(), summed.end(), [](const Vote& a, const Vote& b) { return a.votes > b.votes; });
  std::vector<Vote> chosen;
  for (const Vote& v : summed) {
    if (chosen.size() == static_cast<std::size_t>(max_motions)) break;
    const bool is_known = std::ranges::any_of(chosen, [&](const Vote& c) {
      return alike(c.pose1_from_pose2, v.pose1_from_pose2, middle, size_mm_, options_);
    });
    if (!is_known) chosen.push_back(v);
  }
  return chosen;
}

std::vector<Vote> vote_by_point_pairs(std::span<const SurfacePoint> surface1, std::span<const SurfacePoint> surface2,
                                      double size_mm, int max_motions, const PointPairOptions& options) {
  if (surface1.empty() || surface2.empty()) return {};
  return PointPairTable(surface1, size_mm, options).vote(surface2, max_motions);
}

}  // namespace scanrig
