#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/pose/agreement.h"

namespace scanrig {

/// Limits of what neighbouring samples show together.
struct PatchOptions {
  double cell = 0.08;             ///< width of a patch as a share of the object's size
  std::size_t min_samples = 12;   ///< judged samples of a patch; fewer judge nothing
  double correlated = 4.0;        ///< samples that share one error: neighbours share a matching window
  double limit = 7.0;             ///< standard deviations of a patch's median distance that contradict
  double max_contradicted = 0.5;  ///< share of a patch's judged samples that contradict
};

/// Patch of each sample in the order of `check_samples`: samples of one pose that lie in one cube and face alike.
struct Patches {
  std::vector<std::uint32_t> of_sample;
  std::size_t count = 0;
};
Patches make_patches(const MeasuredPose& pose1, const MeasuredPose& pose2, int level, double cell_mm);

/// Spread of the patches' median distances, mm: errors that more samples do not average away. From a motion that fits.
double patch_spread(const Patches& patches, std::span<const SampleCheck> sample_checks, const PatchOptions& options);

/// How far each patch is from what a motion predicts, in standard deviations: of its median distance, or infinity
/// where more than `max_contradicted` of its samples contradict; NaN where it is not judged. `spread_mm`: as of
/// count_agreement(); `patch_spread_mm`: patch_spread().
std::vector<double> patch_misfits(const Patches& patches, std::span<const SampleCheck> sample_checks, double spread_mm,
                                  double patch_spread_mm, const AgreementOptions& agreement,
                                  const PatchOptions& options);

}  // namespace scanrig
