#pragma once

#include <string>

#include "pipeline/calibrate/calibration_json.h"

namespace scanrig {

/// calibration.html: what a calibration is worth and why, as one page without scripts or other files. Also of one that
/// is refused. Same input, same bytes. docs/reference/calibration-report.md.
std::string calibration_html(const FolderCalibration& outcome, const CalibrationOrigin& origin);

}  // namespace scanrig
