#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "core/result.h"

namespace scanrig::bench {

/// The first view of a rendered scan by this project and by OpenCV's semi-global matchers on the same rectified pair:
/// `own`, `sgbm_3way`, `sgbm_hh4`, each with `seconds` (median of five; own from the images to the range image, theirs
/// of matching alone) and figures of DisparityFigures; and `object_px`. Fails as reading and matching do.
Result<nlohmann::json> measure_peers(const std::filesystem::path& folder);

}  // namespace scanrig::bench
