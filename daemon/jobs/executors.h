#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "daemon/jobs/calibrator.h"
#include "daemon/jobs/reconstructor.h"
#include "pipeline/calibrate/calibrate_images.h"
#include "pipeline/reconstruct/reconstruct.h"

namespace scanrig {

/// The real reconstruction, in this process, within `memory_bytes`; check_memory() of the pipeline refuses a job before
/// it starts.
ReconstructorFactory pipeline_reconstructor(ReconstructOptions options,
                                            std::uintmax_t memory_bytes = std::numeric_limits<std::uintmax_t>::max());

struct ProcessExecutorOptions {
  std::filesystem::path program;  ///< the scanrig command; empty: the one beside this program
  std::chrono::seconds limit = std::chrono::hours(1);
  std::uintmax_t memory_bytes = std::uintmax_t{6} << 30;
  double voxel_mm = 0.25;
};

/// The same reconstruction in a separate process, `scanrig reconstruct`, after the last view: whatever it does, the
/// daemon lives. It reports nothing earlier: an object that cannot be reconstructed is turned over in vain.
ReconstructorFactory process_reconstructor(ProcessExecutorOptions options);

struct SlurmExecutorOptions {
  std::filesystem::path commands;                      ///< folder of sbatch and so on; empty: found in PATH
  std::string partition;                               ///< empty: the cluster's default
  std::vector<std::string> options;                    ///< further words for sbatch
  std::filesystem::path program = "/usr/bin/scanrig";  ///< on the nodes
  /// A folder that the nodes see, with the same path; scans are copied there and models back. Empty: the nodes see the
  /// jobs' folder itself.
  std::filesystem::path stage;
  int cores = 2;      ///< of a job
  int resubmits = 2;  ///< after lost nodes
  enum class Fallback { local, wait };
  Fallback fallback = Fallback::wait;                       ///< when the controller is not reached at a submission
  std::chrono::seconds away_limit = std::chrono::hours(1);  ///< of a controller that is not reached
  ProcessExecutorOptions local;  ///< of `local`; its limit, memory and voxels are those of the cluster's jobs, too
  // Times of the watch.
  std::chrono::milliseconds poll{2000};          ///< between questions to the controller
  std::chrono::milliseconds files_every{250};    ///< between looks at the run's files
  std::chrono::milliseconds files_limit{30000};  ///< until a node's files are seen here, and for a cancelled job to go
};

/// The same reconstruction as a job of a Slurm cluster. The job's id is kept in slurm.json of the scan's folder: a
/// daemon that died, or ended, continues with its job instead of submitting it again. Reports as
/// process_reconstructor(), and the stages "queue" and "no cluster" with 0. Its finish() fails as the reconstruction,
/// and with `timeout` (limit, controller or nodes lost), `refused` (by Slurm), `not_found` (no Slurm here, or the node
/// does not see the folder), `out_of_range` (memory), `stopped`, `io`.
ReconstructorFactory slurm_reconstructor(SlurmExecutorOptions options);

/// The solver of the pipeline, with what the rig's configuration says of board and table. `rig_calibration`: the file
/// that the result is to replace; its hash is written into the new one. Fails as calibrate_boards().
CalibrationSolver calibration_solver(CalibrateOptions options, std::filesystem::path rig_calibration);

}  // namespace scanrig
