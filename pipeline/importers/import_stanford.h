#pragma once

#include <filesystem>
#include <optional>

#include "core/result.h"

namespace scanrig {

/// Makes a scan folder of source `range` from one or two sets of Stanford range scans, one set per pose (.conf and the
/// PLY files beside it).
///
/// Each pose gets its own turntable frame, derived from its own scans alone, so that no relation between the two sets
/// survives. The axis is the one about which all relative motions between its scans rotate (+Y up as in the scans' own
/// frames). y = 0 is the 0.1th percentile of its points' heights; view 0 looks along -Z at angle 0. y = 0 is
/// approximate: the lowest measured points need not touch the table.
/// The scans' cells are not regular. Depth is resampled, linearly between neighbouring cells, onto an orthographic grid
/// of their median spacing that looks along the scanner's own rays. The scanner is assumed on the side of +Z.
///
/// Fails with `exists`, `not_found`, `io`, `invalid_input`, `unsupported`, `degenerate` (a pose of fewer than two
/// scans, or scans that do not turn about one axis).
Result<void> import_stanford(const std::filesystem::path& pose1_conf,
                             const std::optional<std::filesystem::path>& pose2_conf,
                             const std::filesystem::path& out_folder);

}  // namespace scanrig
