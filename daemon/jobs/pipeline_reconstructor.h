#pragma once

#include <cstdint>
#include <limits>

#include "daemon/jobs/reconstructor.h"
#include "pipeline/reconstruct/reconstruct.h"

namespace scanrig {

/// The real reconstruction, in this process. A job that would need more than `memory_bytes` is refused before it
/// starts.
ReconstructorFactory pipeline_reconstructor(ReconstructOptions options,
                                            std::uintmax_t memory_bytes = std::numeric_limits<std::uintmax_t>::max());

/// Whether the estimated memory is within `memory_bytes`. Fails with `out_of_range`, saying what to do.
Result<void> check_memory(const ReconstructionTask& task, double voxel_mm, std::uintmax_t memory_bytes);

}  // namespace scanrig
