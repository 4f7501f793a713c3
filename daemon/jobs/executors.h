#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>

#include "daemon/jobs/calibrator.h"
#include "daemon/jobs/reconstructor.h"
#include "pipeline/calibrate/calibrate_images.h"
#include "pipeline/reconstruct/reconstruct.h"

namespace scanrig {

/// The real reconstruction, in this process. Refuses a job that would need more than `memory_bytes` before it
/// starts.
ReconstructorFactory pipeline_reconstructor(ReconstructOptions options,
                                            std::uintmax_t memory_bytes = std::numeric_limits<std::uintmax_t>::max());

/// Checks that the estimated memory is within `memory_bytes`. Fails with `out_of_range` and the remedy.
Result<void> check_memory(const ReconstructionTask& task, double voxel_mm, std::uintmax_t memory_bytes);

struct ProcessExecutorOptions {
  std::filesystem::path program;  ///< the scanrig command; empty: the one beside this program
  std::chrono::seconds limit = std::chrono::hours(1);
  std::uintmax_t memory_bytes = std::uintmax_t{6} << 30;
  double voxel_mm = 0.25;
};

/// The same reconstruction in a separate process, `scanrig reconstruct`, after the last view: whatever it does, the
/// daemon lives. It reports nothing earlier: an object that cannot be reconstructed is turned over in vain.
ReconstructorFactory process_reconstructor(ProcessExecutorOptions options);

/// The solver of the pipeline, with what the rig's configuration says of board and table. `rig_calibration`: the file
/// that the result is to replace; its hash is written into the new one. Fails as calibrate_boards().
CalibrationSolver calibration_solver(CalibrateOptions options, std::filesystem::path rig_calibration);

}  // namespace scanrig
