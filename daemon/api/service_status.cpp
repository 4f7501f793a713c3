#include "daemon/api/service_status.h"

#include <algorithm>
#include <charconv>

#include "core/files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& path) {
  const auto text = read_file(path);
  return text ? text->substr(0, text->find('\n')) : std::string();
}

}  // namespace

ServiceStatus read_machine(const fs::path& storage) {
  ServiceStatus facts;
  std::error_code error;
  const auto space = fs::space(storage, error);
  if (!error) {
    facts.disk_bytes = space.capacity;
    facts.disk_free_bytes = space.available;
  }
  for (fs::directory_iterator next("/sys/class/thermal", error), end; !error && next != end; next.increment(error)) {
    if (!next->path().filename().string().starts_with("thermal_zone")) continue;
    const auto text = first_line(next->path() / "temp");
    int millidegrees = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), millidegrees);
    if (read.ec != std::errc()) continue;
    const auto name = first_line(next->path() / "type");
    facts.temperatures.push_back({name.empty() ? next->path().filename().string() : name, millidegrees / 1000.0});
  }
  std::ranges::sort(facts.temperatures, {}, &Temperature::sensor);
  return facts;
}

}  // namespace scanrig
