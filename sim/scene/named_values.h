#pragma once

#include <array>
#include <charconv>
#include <string>
#include <string_view>

#include "core/result.h"

namespace scanrig::sim {

/// A number of an options struct that a command line sets by name.
template <class Options>
struct NamedValue {
  const char* name;
  double Options::*member;
};

/// Sets the values of `text`, "NAME=NUMBER" or "NAME" (which is 1), separated by commas. Fails with `invalid_input`
/// (not a number), `not_found` (no such name; lists those there are).
template <class Options, std::size_t N>
Result<void> set_by_name(Options& options, const std::array<NamedValue<Options>, N>& values, std::string_view text) {
  while (!text.empty()) {
    const std::string_view item = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), item.size() + 1));
    const std::string_view name = item.substr(0, item.find('='));
    double number = 1.0;
    if (name.size() < item.size()) {
      const std::string_view digits = item.substr(name.size() + 1);
      const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), number);
      if (read.ec != std::errc() || read.ptr != digits.data() + digits.size()) {
        return fail(ErrorCode::invalid_input, "{}: not a number; write NAME=NUMBER", item);
      }
    }
    std::string names;
    bool found = false;
    for (const auto& value : values) {
      if (name == value.name) options.*value.member = number, found = true;
      names += std::string(names.empty() ? "" : ", ") + value.name;
    }
    if (!found) return fail(ErrorCode::not_found, "{}: no such name; choose from {}", name, names);
  }
  return {};
}

}  // namespace scanrig::sim
