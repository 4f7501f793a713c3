#pragma once

#include <filesystem>

#include "daemon/jobs/calibrator.h"
#include "pipeline/calibrate/calibrate_images.h"

namespace scanrig {

/// The solver of the pipeline, with what the rig's configuration says of board and table. `rig_calibration`: the file
/// that the result is to replace; its hash is written into the new one. Fails as calibrate_boards().
CalibrationSolver calibration_solver(CalibrateOptions options, std::filesystem::path rig_calibration);

}  // namespace scanrig
