#pragma once

#include <filesystem>

#include "core/result.h"
#include "sim/scene/calibration_series.h"

namespace scanrig::sim {

/// calibration_truth.json into `folder`: cameras with their lens residual, table, board and what each pair shows, see
/// docs/reference/calibration-images.md. For evaluation only. Fails with `io`.
Result<void> write_calibration_truth(const CalibrationSeries& series, const std::filesystem::path& folder);

}  // namespace scanrig::sim
