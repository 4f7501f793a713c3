#pragma once

#include <filesystem>
#include <optional>

#include "core/result.h"

namespace scanrig {

/// Makes a scan folder of source `range` from one or two sets of Stanford range scans (.conf and the PLY files beside
/// it), one set a pose.
///
/// Each pose gets a turntable frame of its own, derived from its own scans alone, so that nothing of how the two sets
/// lie to each other survives: the axis is the one about which all relative motions between its scans rotate (+Y up as
/// in the scans' own frames), y = 0 is the 0.1th percentile of its points' heights, view 0 looks along -Z at angle 0.
/// y = 0 is approximate: the lowest measured points need not touch the table.
/// The scans' cells are not regular: depth is resampled, linearly between neighbouring cells, onto an orthographic grid
/// of their median spacing that looks along the scanner's own rays. The scanner is taken to be on the side of +Z.
///
/// Fails with `exists`, `not_found`, `io`, `invalid_input`, `unsupported`, `degenerate` (a pose of fewer than two
/// scans, or scans that do not turn about one axis).
Result<void> import_stanford(const std::filesystem::path& pose1_conf,
                             const std::optional<std::filesystem::path>& pose2_conf,
                             const std::filesystem::path& out_folder);

}  // namespace scanrig
