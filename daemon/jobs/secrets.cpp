#include "daemon/jobs/secrets.h"

#include <algorithm>

namespace scanrig {
namespace {

constexpr std::string_view kRemoved = "(removed)";
constexpr std::string_view kTokenCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// Replaces the text after each `prefix`, up to the first character that `end` finds.
template <class End>
std::string masked(std::string_view text, std::string_view prefix, const End& end) {
  std::string out;
  std::size_t at = 0;
  for (auto found = text.find(prefix); found != std::string_view::npos; found = text.find(prefix, at)) {
    const auto secret = found + prefix.size();
    out.append(text.substr(at, secret - at)).append(kRemoved);
    at = std::min(end(secret), text.size());
  }
  return out.append(text.substr(at));
}

}  // namespace

std::string without_secrets(std::string_view text) {
  const auto tokens =
      masked(text, "scanrig_", [&](std::size_t from) { return text.find_first_not_of(kTokenCharacters, from); });
  const std::string_view rest = tokens;
  return masked(rest, "://", [&](std::size_t from) { return rest.find_first_of(" \t\r\n\"'`<>,", from); });
}

}  // namespace scanrig
