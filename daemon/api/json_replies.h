#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/station/snapshot.h"

namespace scanrig {

struct ApiStation;

/// In the folder of all jobs: the last report of `scanrig doctor --json`.
inline constexpr std::string_view kDoctorFile = "doctor.json";

/// The API's replies as JSON, in the shapes of openapi.cpp.
nlohmann::ordered_json to_json(const Error& error);
nlohmann::ordered_json to_json(const std::optional<Error>& error);
nlohmann::ordered_json to_json(const Snapshot& snapshot);       ///< Status
nlohmann::ordered_json to_json(const JobInfo& job);             ///< Job
nlohmann::ordered_json to_detailed_json(const JobInfo& job);    ///< JobDetail
nlohmann::ordered_json io_table(const Snapshot& snapshot);      ///< Io
nlohmann::ordered_json health_json(const ApiStation& station);  ///< Health

/// Paths come from the file system and need not be UTF-8: invalid bytes are replaced.
std::string to_text(const nlohmann::ordered_json& json);
/// The same without line breaks.
std::string to_line(const nlohmann::ordered_json& json);

}  // namespace scanrig
