#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>

#include "daemon/jobs/reconstructor.h"

namespace scanrig {

struct ProcessExecutorOptions {
  std::filesystem::path program;  ///< the scanrig command; empty: the one beside this program
  std::chrono::seconds limit = std::chrono::hours(1);
  std::uintmax_t memory_bytes = std::uintmax_t{6} << 30;
  double voxel_mm = 0.25;
};

/// The same reconstruction in a separate process, `scanrig reconstruct`, after the last view: whatever it does, the
/// daemon lives. It reports nothing earlier: an object that cannot be reconstructed is turned over in vain.
ReconstructorFactory process_reconstructor(ProcessExecutorOptions options);

}  // namespace scanrig
