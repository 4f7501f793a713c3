#pragma once

#include "daemon/jobs/reconstructor.h"
#include "pipeline/reconstruct/reconstruct.h"

namespace scanrig {

/// The real reconstruction, in this process.
ReconstructorFactory pipeline_reconstructor(ReconstructOptions options);

}  // namespace scanrig
