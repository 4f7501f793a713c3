#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "drivers/turntable/drive_profile.h"

namespace scanrig::config {

/// A drive profile, see config/drives/leadshine-rs.toml. Fails with `not_found`, `io`, `invalid_input` (every problem
/// with file and line).
Result<DriveProfile> read_drive_profile(const std::filesystem::path& file);

/// Reads a profile from its text; `file` is only a name. Warnings go to `warnings`. Fails with `invalid_input`.
Result<DriveProfile> parse_drive_profile(std::string_view text, const std::filesystem::path& file,
                                         std::vector<std::string>& warnings);

}  // namespace scanrig::config
