#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pipeline/pose/symmetry.h"

namespace scanrig {

SelfComparison::SelfComparison(std::vector<View> views, int levels, double spread_mm, double patch_spread_mm,
                               const AgreementOptions& agreement, const SymmetryOptions& options)
    : views_(std::move(views)),
      measured_(measured_pose(views_, levels)),
      spread_mm_(spread_mm),
      patch_spread_mm_(patch_spread_mm),
      agreement_(agreement),
      options_(options) {
  patches_ = make_patches(measured_, measured_, options_.level, options_.patches.cell * measured_.size_mm);
  const auto& samples = measured_.samples[static_cast<std::size_t>(options_.level)];
  Eigen::Matrix3d across = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const SurfacePoint& sample : samples) {
    middle_ += sample.point;
    const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - sample.normal * sample.normal.transpose();
    across += off;
    right += off * sample.point;
  }
  focus_ = across.ldlt().solve(right);
  middle_ /= static_cast<double>(std::max<std::size_t>(samples.size(), 1));
  far_off_unmoved_ = far_off(checks_of(Transform::Identity()));
}

std::vector<SampleCheck> SelfComparison::checks_of(const Transform& motion) const {
  const PoseObservations self{&measured_, views_};
  return check_samples(self, self, motion, options_.level, options_.reach * measured_.size_mm, agreement_);
}

Eigen::Vector3d SelfComparison::halfway(const Eigen::Vector3d& axis, const Eigen::Vector3d& point) const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const SurfacePoint& sample : measured_.samples[static_cast<std::size_t>(options_.level)]) {
    const double along = axis.dot(sample.point - point);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  return point + 0.5 * (low + high) * axis;
}

double SelfComparison::far_off(const std::vector<SampleCheck>& checks) const {
  AgreementOptions wide = agreement_;
  wide.tolerance = wide.wide_tolerance;
  return count_agreement(checks, spread_mm_, wide).contradicted_share();
}

std::optional<Transform> SelfComparison::symmetric_near(const Transform& motion, std::span<const FreeTurn> held) const {
  RefineOptions refine;
  refine.max_iterations = options_.iterations;
  refine.held.assign(held.begin(), held.end());
  const RefinedPose aligned =
      align(measured_, measured_, motion, options_.level, options_.capture * measured_.size_mm, refine);
  if (aligned.iterations == 0) return std::nullopt;
  const Transform& found = aligned.pose1_from_pose2;
  const auto checks = checks_of(found);
  if (count_agreement(checks, spread_mm_, agreement_).confirmed < options_.min_confirmed) return std::nullopt;
  if (far_off(checks) > far_off_unmoved_ + options_.max_far_off) return std::nullopt;
  const auto misfits = patch_misfits(patches_, checks, spread_mm_, patch_spread_mm_, agreement_, options_.patches);
  std::size_t judged = 0, contradicted = 0;
  for (const double misfit : misfits) {
    if (std::isnan(misfit)) continue;
    ++judged;
    contradicted += misfit > options_.patches.limit ? 1 : 0;
  }
  const auto allowed =
      std::max(static_cast<double>(options_.min_misfits - 1), options_.max_misfits * static_cast<double>(judged));
  if (static_cast<double>(contradicted) > allowed) return std::nullopt;
  return found;
}

}  // namespace scanrig
