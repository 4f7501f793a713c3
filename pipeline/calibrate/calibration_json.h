#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/calibrate/calibrate_images.h"
#include "pipeline/calibration/drift/check_drift.h"

namespace scanrig {

/// What the images do not tell of a calibration.
struct CalibrationOrigin {
  std::string date;                                            ///< ISO 8601
  std::optional<double> temperature_c{};                       ///< of the rig
  std::string previous{};                                      ///< sha256 of the calibration it replaces; empty: none
  std::vector<std::pair<std::string, std::string>> sources{};  ///< file name and sha256 of each image
};

/// calibration.json, version 2 (docs/reference/scan-folder.md): the text of the file. Fails with `below_limits` for a
/// calibration that is refused: the operator's sentences are the message.
Result<std::string> calibration_json(const FolderCalibration& outcome, const CalibrationOrigin& origin);

/// The text of the calibration `known` (version 2) with the poses that a drift check found; docs as above. Fails with
/// `invalid_input` (the text).
Result<std::string> moved_calibration_json(std::string_view known, const DriftCheck& check,
                                           const CalibrationOrigin& origin);

}  // namespace scanrig
