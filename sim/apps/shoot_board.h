#pragma once

#include <filesystem>

#include "core/result.h"
#include "sim/scene/calibration_series.h"

namespace scanrig::sim {

/// Renders a calibration series into the new folder `folder`: images, calibration_images.json (unless the board is held
/// by hand: then the names suffice), and the truth; docs/reference/calibration-images.md. The same options give the
/// same bytes. Fails as CalibrationSeries::create, and with `exists` (the folder has a series), `io`.
Result<void> shoot_board(const SeriesOptions& options, const std::filesystem::path& folder);

}  // namespace scanrig::sim
