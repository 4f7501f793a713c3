#pragma once

#include <string>

#include "daemon/station/job_info.h"

namespace scanrig {

/// A job as one line of JSON, for the index. Nothing else reads it, so it has no version and changes freely.
std::string to_record(const JobInfo& job);
/// False when the text is not what to_record() writes today.
bool from_record(const std::string& text, JobInfo& job);

}  // namespace scanrig
