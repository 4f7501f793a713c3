#include "pipeline/pose/patches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "core/statistics.h"

namespace scanrig {
namespace {

using PatchKey = std::array<int, 5>;  // pose, direction, cube

int main_direction(const Eigen::Vector3d& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * static_cast<int>(axis) + (normal[axis] < 0.0 ? 1 : 0);
}

/// Distances of the patches' samples, and how many of them contradict.
struct PatchSamples {
  std::vector<double> distances;
  std::size_t judged = 0;
  std::size_t contradicted = 0;
};

std::vector<PatchSamples> samples_by_patch(const Patches& patches, std::span<const SampleCheck> sample_checks,
                                           double spread_mm, const AgreementOptions& agreement) {
  std::vector<PatchSamples> all(patches.count);
  for (std::size_t i = 0; i < sample_checks.size(); ++i) {
    const SampleCheck& check = sample_checks[i];
    if (check.kind == SampleCheck::Kind::unknown) continue;
    PatchSamples& patch = all[patches.of_sample[i]];
    ++patch.judged;
    patch.contradicted += contradicts(check, spread_mm, agreement.tolerance) ? 1 : 0;
    if (check.kind == SampleCheck::Kind::surface) patch.distances.push_back(check.distance_mm);
  }
  return all;
}

}  // namespace

Patches make_patches(const MeasuredPose& pose1, const MeasuredPose& pose2, int level, double cell_mm) {
  Patches patches;
  std::map<PatchKey, std::uint32_t> known;
  for (const MeasuredPose* pose : {&pose2, &pose1}) {
    for (const SurfacePoint& sample : pose->samples[static_cast<std::size_t>(level)]) {
      const Eigen::Vector3i cube = (sample.point / cell_mm).array().floor().cast<int>();
      const PatchKey key{pose == &pose2 ? 1 : 0, main_direction(sample.normal), cube.x(), cube.y(), cube.z()};
      patches.of_sample.push_back(known.try_emplace(key, static_cast<std::uint32_t>(known.size())).first->second);
    }
  }
  patches.count = known.size();
  return patches;
}

double patch_spread(const Patches& patches, std::span<const SampleCheck> sample_checks, const PatchOptions& options) {
  std::vector<double> medians;
  for (PatchSamples& patch : samples_by_patch(patches, sample_checks, 0.0, {})) {
    if (patch.distances.size() < options.min_samples) continue;
    medians.push_back(std::abs(quantile(std::move(patch.distances), 0.5)));
  }
  return medians.empty() ? 0.0 : 1.4826 * quantile(std::move(medians), 0.5);
}

std::vector<double> patch_misfits(const Patches& patches, std::span<const SampleCheck> sample_checks, double spread_mm,
                                  double patch_spread_mm, const AgreementOptions& agreement,
                                  const PatchOptions& options) {
  std::vector<double> misfits;
  misfits.reserve(patches.count);
  for (const PatchSamples& patch : samples_by_patch(patches, sample_checks, spread_mm, agreement)) {
    double misfit = std::numeric_limits<double>::quiet_NaN();
    if (patch.distances.size() >= options.min_samples) {
      const double median = quantile(patch.distances, 0.5);
      std::vector<double> off;
      for (const double d : patch.distances) off.push_back(std::abs(d - median));
      const double own = 1.4826 * quantile(std::move(off), 0.5);
      const double of_median = 1.25 * own * std::sqrt(options.correlated / static_cast<double>(patch.distances.size()));
      misfit = std::abs(median) / std::max(std::hypot(of_median, patch_spread_mm), 1e-9);
    }
    if (patch.judged >= options.min_samples &&
        static_cast<double>(patch.contradicted) > options.max_contradicted * static_cast<double>(patch.judged)) {
      misfit = std::numeric_limits<double>::infinity();
    }
    misfits.push_back(misfit);
  }
  return misfits;
}

}  // namespace scanrig
