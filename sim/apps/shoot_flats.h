#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/result.h"
#include "sim/scene/effects.h"

namespace scanrig::sim {

struct ShootFlatsOptions {
  ChosenProfile profile{};
  std::uint64_t seed = 1;
  double image_scale = 1.0;
  /// Of pairs with light; the second last fills 70 % of full scale, the last saturates. Exposures of one pair each.
  std::vector<double> exposures_us{500.0, 1000.0, 2000.0, 4000.0, 6000.0, 8000.0, 40000.0};
  int dark_pairs = 8;
};

/// Renders flat images of both cameras into the new folder `folder`, as an operator takes them: an uneven sheet of
/// paper before both lenses in light that flickers as the profile has it, and covered lenses; with flats.json and the
/// truth, flats_truth.json (docs/reference/characterisation.md). The same options give the same bytes. Fails with
/// `exists` (the folder has flats), `out_of_range` (image_scale, dark_pairs, exposures), `io`.
Result<void> shoot_flats(const ShootFlatsOptions& options, const std::filesystem::path& folder);

}  // namespace scanrig::sim
