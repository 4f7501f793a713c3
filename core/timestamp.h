#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace scanrig {

/// "2026-11-21T09:30:00Z"
std::string iso_time(std::chrono::system_clock::time_point when);

/// The inverse; nothing for any other text.
std::optional<std::chrono::system_clock::time_point> parse_iso_time(const std::string& text);

/// "20261121-093000-1": sorts by time; `serial` distinguishes what starts in the same second.
std::string job_id(std::chrono::system_clock::time_point when, int serial);

}  // namespace scanrig
