#include "daemon/api/metrics.h"

#include <fmt/format.h>
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

/// A label's value must escape only backslash, quote and line break.
std::string escaped(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    if (c == '\\' || c == '"') plain += '\\';
    plain += c == '\n' ? ' ' : c;
  }
  return plain;
}

class Text {
 public:
  void begin(std::string_view name, std::string_view kind, std::string_view help) {
    name_ = name;
    text_ += fmt::format("# HELP scanrig_{} {}\n# TYPE scanrig_{} {}\n", name, help, name, kind);
  }
  void value(double number) { text_ += fmt::format("scanrig_{} {}\n", name_, number); }
  void value(std::string_view label, std::string_view is, double number) {
    text_ += fmt::format("scanrig_{}{{{}=\"{}\"}} {}\n", name_, label, escaped(is), number);
  }
  void one(std::string_view name, std::string_view kind, std::string_view help, double number) {
    begin(name, kind, help);
    value(number);
  }
  [[nodiscard]] std::string take() && { return std::move(text_); }

 private:
  std::string_view name_;
  std::string text_;
};

constexpr MachineState kMachineStates[] = {MachineState::preoperational,   MachineState::halted,
                                           MachineState::maintenance,      MachineState::error,
                                           MachineState::initialized,      MachineState::ready,
                                           MachineState::single_execution, MachineState::continuous_execution};

void station(const Snapshot& snapshot, Text& text) {
  text.begin("machine_state", "gauge", "1 for the state the machine is in.");
  for (const auto state : kMachineStates) text.value("state", to_string(state), state == snapshot.machine ? 1 : 0);
  text.one("may_be_moving", "gauge", "1 while the last stop is not confirmed.", snapshot.may_be_moving ? 1 : 0);
  text.begin("device_up", "gauge", "1 for a device that responds.");
  for (const auto& device : snapshot.devices) text.value("device", device.name, device.problem ? 0 : 1);
  std::map<std::string_view, double> jobs;
  for (const auto& [id, job] : snapshot.jobs) ++jobs[to_string(job->state)];
  text.begin("jobs", "gauge", "Jobs by state.");
  for (const auto& [state, count] : jobs) text.value("state", state, count);
}

void counters(const Counters& counts, Text& text) {
  const auto number = [](std::uint64_t count) { return static_cast<double>(count); };
  text.one("views_stored_total", "counter", "Views that survive a power cut.", number(counts.views_stored));
  text.one("retakes_total", "counter", "Exposures that were lost and taken again.", number(counts.retakes));
  text.one("retries_total", "counter", "Old name of retakes_total.", number(counts.retakes));  // old name
  text.one("faults_total", "counter", "Faults of rig, panel and disk, e-stops included.", number(counts.faults));
  text.one("deadlines_missed_total", "counter", "Faults that were a deadline passed.", number(counts.deadlines_missed));
  text.begin("jobs_ended_total", "counter", "Jobs that ended, by state.");
  for (const auto& [state, count] : counts.jobs_ended) text.value("state", state, number(count));
  text.begin("stage_seconds_total", "counter", "Time spent in stages of the reconstruction.");
  for (const auto& [stage, seconds] : counts.stage_seconds) text.value("stage", stage, seconds);
}

void machine(const ServiceStatus& facts, Text& text) {
  text.one("uptime_seconds", "gauge", "Since the service started.", facts.uptime_s);
  text.one("disk_bytes", "gauge", "Size of the disk that keeps the jobs.", static_cast<double>(facts.disk_bytes));
  text.one("disk_free_bytes", "gauge", "Free on it.", static_cast<double>(facts.disk_free_bytes));
  text.begin("temperature_celsius", "gauge", "Sensors of the machine.");
  for (const auto& one : facts.temperatures) text.value("sensor", one.sensor, one.celsius);
  text.one("api_connections", "gauge", "Open connections.", static_cast<double>(facts.connections));
  text.one("api_event_streams", "gauge", "Of them streams of events.", static_cast<double>(facts.event_streams));
  text.one("api_requests_total", "counter", "Requests received.", static_cast<double>(facts.requests));
  text.one("api_refused_total", "counter", "Requests and connections refused by role or limit.",
           static_cast<double>(facts.refused));
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

std::string metrics_text(const Snapshot& snapshot, const ServiceStatus& facts) {
  Text text;
  station(snapshot, text);
  counters(snapshot.counters, text);
  machine(facts, text);
  return std::move(text).take();
}

}  // namespace scanrig
