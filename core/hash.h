#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace scanrig {

/// SHA-256 as 64 lower-case hexadecimal digits.
std::string sha256(std::span<const std::byte> bytes);
std::string sha256(std::string_view text);

}  // namespace scanrig
