#include "daemon/api/origins.h"

#include <fmt/core.h>
#include <limits.h>
#include <strings.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "daemon/api/roles.h"

namespace scanrig {
namespace {

bool same_name(std::string_view a, std::string_view b) {
  return a.size() == b.size() && ::strncasecmp(a.data(), b.data(), a.size()) == 0;
}

std::string machine_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

std::string_view without_port(std::string_view host) {
  const auto colon = host.rfind(':');
  if (colon == std::string_view::npos || colon < host.rfind(']') + 1) return host;
  const auto port = host.substr(colon + 1);
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return std::ranges::all_of(port, is_digit) ? host.substr(0, colon) : host;
}

bool is_address(std::string_view name) {
  if (name.starts_with('[') && name.ends_with(']')) name = name.substr(1, name.size() - 2);
  return plain_address(name).has_value();
}

std::string_view host_of(std::string_view origin) {
  const auto slashes = origin.find("://");
  return slashes == std::string_view::npos ? "" : without_port(origin.substr(slashes + 3));
}

}  // namespace

OwnOrigins::OwnOrigins(std::string http_origin) : http_origin_(std::move(http_origin)), machine_(machine_name()) {}

bool OwnOrigins::is_own_host(std::string_view host) const {
  constexpr std::string_view kLocal = ".local";
  const auto name = without_port(host);
  if (name.empty()) return false;
  const bool is_local = name.size() > kLocal.size() && same_name(name.substr(name.size() - kLocal.size()), kLocal);
  return is_address(name) || same_name(name, "localhost") || same_name(name, machine_) || is_local ||
         (!http_origin_.empty() && same_name(name, host_of(http_origin_)));
}

bool OwnOrigins::is_own_origin(std::string_view origin, std::string_view host) const {
  return same_name(origin, fmt::format("http://{}", host)) ||
         (!http_origin_.empty() && same_name(origin, http_origin_));
}

std::string_view cookie_value(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const auto end = std::min(header.find(';'), header.size());
    auto one = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    one.remove_prefix(std::min(one.find_first_not_of(' '), one.size()));
    if (one.size() > name.size() && one.starts_with(name) && one[name.size()] == '=')
      return one.substr(name.size() + 1);
  }
  return {};
}

}  // namespace scanrig
