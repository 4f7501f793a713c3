#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "core/result.h"

namespace scanrig::bench {

/// Matches every view of a rendered scan and measures it against its truth: figures of DisparityFigures, `seconds` per
/// view, and `depth_median_mm`, `depth_p95_mm` of what is measured. `rows_px`: rows of the right images are moved by a
/// smooth field of up to this many pixels. Fails as reading and matching do.
Result<nlohmann::json> measure_scan(const std::filesystem::path& folder, double rows_px);

}  // namespace scanrig::bench
