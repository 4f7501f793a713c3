#pragma once

#include <filesystem>
#include <string>

#include "daemon/ctl/doctor/findings.h"

namespace scanrig::ctl::doctor {

/// Lists serial adapters, GPIO chips with their named lines, USB devices and the groups of the user.
void list_what_is_connected(Report& report);

/// Whether this user may open `device` for reading and writing. Where not, a finding says why: no such device, or the
/// group that is missing (`device_missing`, `missing_group`).
bool may_open(const std::filesystem::path& device, const std::string& section, Report& report);

/// The udev rule that gives the adapter behind `device` the name the configuration uses, and the systemd unit, where
/// this machine has none yet.
void print_missing_snippets(const std::filesystem::path& device, const std::filesystem::path& config, Report& report);

}  // namespace scanrig::ctl::doctor
