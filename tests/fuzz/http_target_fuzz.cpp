#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/api/request.h"
#include "daemon/api/route.h"

namespace {

using namespace scanrig;

/// A decoded name that could lead out of its folder.
bool leaves(std::string_view segment) {
  for (;;) {
    const auto slash = segment.find('/');
    const auto part = segment.substr(0, slash);
    if (part.empty() || part == "." || part == ".." || part.find('\0') != std::string_view::npos) return true;
    if (slash == std::string_view::npos) return false;
    segment.remove_prefix(slash + 1);
  }
}

}  // namespace

// "METHOD target": any input is decoded to names that stay below their folder, or refused with an error that
// the API documents.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Router router;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto space = text.find(' ');
  const auto method = text.substr(0, space);
  const auto target = space == std::string_view::npos ? std::string_view() : text.substr(space + 1);
  if (const auto parsed = parse_target(target)) {
    for (const auto& segment : parsed->segments) {
      if (leaves(segment)) std::abort();
    }
  }
  for (const Role role : kRoles) {
    const auto match = router.find(method, target, role);
    if (match) {
      if (role < match->route->role || to_string(match->route->method) != method) std::abort();
      if (const auto file = match->values.text("file"); file && leaves(*file)) std::abort();
    } else if (const unsigned status = match.error().status; status < 400 || status > 405) {
      std::abort();
    }
  }
  const auto nobody = router.find(method, target, std::nullopt);
  if (nobody || nobody.error().status != 401) std::abort();
  return 0;
}
