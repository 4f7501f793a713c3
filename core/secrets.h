#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"

namespace scanrig {

/// Random bytes of the system, as lower-case hexadecimal digits. Fails with `io`.
Result<std::string> random_hexadecimal(std::size_t bytes);
/// 8 characters (39 bits) that are not mistaken for each other when they are read aloud. Fails with `io`.
Result<std::string> random_code();

/// Fails with `io` where the file cannot be looked at, `refused` where others than its owner may read or write it, or
/// where it is neither the caller's nor root's.
Result<void> check_private(const std::filesystem::path& path);
/// Replaces the file as a whole, durable, mode 0600; where root writes it, it goes to the owner of its folder.
/// Fails with `io`.
Result<void> write_private_file(const std::filesystem::path& path, const std::string& text);

}  // namespace scanrig
