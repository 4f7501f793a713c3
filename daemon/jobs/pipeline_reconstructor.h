#pragma once

#include <cstdint>
#include <limits>

#include "daemon/jobs/reconstructor.h"
#include "pipeline/reconstruct/reconstruct.h"

namespace scanrig {

/// The real reconstruction, in this process. Refuses a job that would need more than `memory_bytes` before it
/// starts.
ReconstructorFactory pipeline_reconstructor(ReconstructOptions options,
                                            std::uintmax_t memory_bytes = std::numeric_limits<std::uintmax_t>::max());

/// Checks that the estimated memory is within `memory_bytes`. Fails with `out_of_range` and the remedy.
Result<void> check_memory(const ReconstructionTask& task, double voxel_mm, std::uintmax_t memory_bytes);

}  // namespace scanrig
