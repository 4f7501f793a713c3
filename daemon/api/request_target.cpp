#include "daemon/api/request_target.h"

#include <algorithm>
#include <optional>

namespace scanrig {
namespace {

constexpr std::size_t kMaxLength = 2048;

int hexadecimal(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

/// Nothing for a bad escape and for forbidden characters, escaped or not.
std::optional<std::string> decode(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hexadecimal(text[i + 1]), low = hexadecimal(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (is_control(c) || c == '\\') return std::nullopt;
    plain += c;
  }
  return plain;
}

/// No part of `segment` between its slashes is empty, "." or "..": it can be appended to a folder and stays below it.
bool stays_below(std::string_view segment) {
  for (;;) {
    const auto slash = segment.find('/');
    const auto part = segment.substr(0, slash);
    if (part.empty() || part == "." || part == "..") return false;
    if (slash == std::string_view::npos) return true;
    segment.remove_prefix(slash + 1);
  }
}

tl::unexpected<Error> bad(std::string_view problem) {
  return fail(ErrorCode::invalid_input, "the request's target {}", problem);
}

}  // namespace

Result<RequestTarget> parse_target(std::string_view target) {
  if (target.size() > kMaxLength) return bad("is too long");
  if (!target.starts_with('/')) return bad("does not begin with a slash");
  RequestTarget parsed;
  const auto mark = target.find('?');
  auto path = target.substr(1, mark == std::string_view::npos ? mark : mark - 1);
  for (bool more = !path.empty(); more;) {
    const auto slash = path.find('/');
    auto segment = decode(path.substr(0, slash));
    if (!segment || !stays_below(*segment)) return bad("has a segment that is not a name");
    parsed.segments.push_back(std::move(*segment));
    more = slash != std::string_view::npos;
    path.remove_prefix(more ? slash + 1 : path.size());
  }
  auto query = mark == std::string_view::npos ? std::string_view() : target.substr(mark + 1);
  while (!query.empty()) {
    const auto end = query.find('&');
    const auto item = query.substr(0, end);
    const auto equals = item.find('=');
    const auto key = decode(item.substr(0, equals));
    const auto value = decode(equals == std::string_view::npos ? std::string_view() : item.substr(equals + 1));
    if (!key || !value || key->empty()) return bad("has a query that cannot be understood");
    if (std::ranges::find(parsed.query, *key, &std::pair<std::string, std::string>::first) != parsed.query.end()) {
      return bad("has a key twice");
    }
    parsed.query.emplace_back(*key, *value);
    query = end == std::string_view::npos ? std::string_view() : query.substr(end + 1);
  }
  return parsed;
}

}  // namespace scanrig
