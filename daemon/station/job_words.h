#pragma once

#include "daemon/station/job_info.h"
#include "daemon/station/words.h"

namespace scanrig {

/// What becomes of one job, why, and what the operator should do about it.
Words describe(const JobInfo& job);

}  // namespace scanrig
