#pragma once

#include <cstdlib>
#include <filesystem>

namespace scanrig {

/// Real captures and scans, which are no part of the project: beside it, or where SCANRIG_SHARED_DATA says. A test that
/// needs them skips itself, saying so, where they are absent.
inline std::filesystem::path shared_data() {
  const char* given = std::getenv("SCANRIG_SHARED_DATA");
  return given != nullptr ? std::filesystem::path(given) : std::filesystem::path(SCANRIG_SOURCE_DIR) / "../shared/data";
}

}  // namespace scanrig
