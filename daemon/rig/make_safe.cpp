#include "daemon/rig/make_safe.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/files.h"
#include "daemon/rig/open_devices.h"

namespace scanrig {
namespace {

using config::SafetyDevice;

constexpr auto kLimit = std::chrono::milliseconds(900);
constexpr auto kPeriod = std::chrono::milliseconds(20);

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

/// Limit of one attempt: a stop without confirmation is sent again.
Deadline attempt_deadline(Clock& clock, Deadline all) { return all.at_most(clock, kLimit); }

template <class Try>
Result<void> until(Clock& clock, Deadline deadline, const Try& attempt) {
  for (;;) {
    auto done = attempt();
    if (done || deadline.left(clock) <= kPeriod) return done;
    clock.sleep_for(kPeriod);
  }
}

Result<void> stop_table(const Result<config::RigConfig>& config, Clock& clock, Deadline deadline) {
  if (!config) return pass_on(config);
  const auto turntable = open_turntable(config->turntable, clock);
  if (!turntable) return pass_on(turntable);
  return until(clock, deadline, [&] { return (*turntable)->stop(attempt_deadline(clock, deadline)); });
}

/// Kept until all is done: a released line falls back, and its lamp goes out.
template <class Device>
struct Held {
  std::unique_ptr<gpio::Lines> lines;
  std::unique_ptr<Device> device;
};

Result<void> darken(const Result<config::RigConfig>& config, Clock& clock, Deadline deadline, Held<Projector>& held) {
  if (!config) return pass_on(config);
  // Its light ended with the last exposure. The camera may still belong to the daemon that died.
  if (config->projector.driver == config::ProjectorConfig::Driver::camera_strobe) return {};
  held.lines = open_lines(*config, clock);
  auto projector = open_projector(config->projector, *held.lines, clock);
  if (!projector) return pass_on(projector);
  held.device = std::move(*projector);
  return until(clock, deadline, [&] { return held.device->turn_off(attempt_deadline(clock, deadline)); });
}

Result<void> show_red(const Result<config::RigConfig>& config, Clock& clock, Deadline deadline, Held<Panel>& held) {
  if (!config) return pass_on(config);
  held.lines = open_lines(*config, clock);
  held.device = open_panel(*config, *held.lines, clock);
  return until(clock, deadline, [&] { return held.device->show({.red = true}, attempt_deadline(clock, deadline)); });
}

void report_error(const char* program, const std::set<std::string>& why) {
  for (const auto& message : why) fmt::print(stderr, "{}: make-safe: {}\n", program, message);
}

/// Reports once why the daemon's own configuration could not be used.
DeviceConfigs config_to_use(const std::filesystem::path& file, const char* program) {
  const auto kept = saved_config_folder(file) / "rig.toml";
  const auto base = file.parent_path();
  std::set<std::string> why;
  const auto read = [&](SafetyDevice device) {
    auto config = config::read_device_config(device, kept, base);
    if (config) return config;
    why.insert(config.error().code == ErrorCode::not_found
                   ? fmt::format("No saved configuration in {}; using {}.", kept.parent_path().string(), file.string())
                   : fmt::format("{}; using {}.", config.error().message, file.string()));
    return config::read_device_config(device, file, base);
  };
  DeviceConfigs config{read(SafetyDevice::turntable), read(SafetyDevice::projector), read(SafetyDevice::panel)};
  report_error(program, why);
  return config;
}

/// Kills a process that ran out of time, and waits for it: no other process may be left with its number.
std::optional<int> wait_for_end(pid_t child, Clock& clock, Deadline deadline) {
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (deadline.expired(clock)) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      return std::nullopt;
    }
    clock.sleep_for(kPeriod);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

template <class... Value>
std::set<std::string> errors_of(const Result<Value>&... results) {
  std::set<std::string> messages;
  ((results ? void() : void(messages.insert(results.error().message))), ...);
  return messages;
}

}  // namespace

std::filesystem::path saved_config_folder(const std::filesystem::path& file) {
  if (const char* runtime = std::getenv("RUNTIME_DIRECTORY")) return std::filesystem::path(runtime) / "running";
  return file.parent_path() / (file.stem().string() + ".running");
}

Result<void> save_config(const config::RigConfig& config, const std::filesystem::path& folder) {
  auto prepared = folder;
  prepared += ".new";
  std::error_code ignored;
  std::filesystem::remove_all(prepared, ignored);  // left by a daemon that died while it wrote
  if (auto made = create_directories_synced(prepared / "drives"); !made) return made;
  if (const auto& profile = config.turntable.profile_file) {
    const FileContent file{profile->name, bytes_of(profile->text)};
    if (auto written = write_files_synced(prepared / "drives", {&file, 1}); !written) return written;
  }
  const FileContent file{"rig.toml", bytes_of(config.text)};
  if (auto written = write_files_synced(prepared, {&file, 1}); !written) return written;
  return replace_folder(prepared, folder);
}

MadeSafe make_safe(const DeviceConfigs& config, Clock& clock, Deadline deadline) {
  MadeSafe made;
  Held<Projector> light;
  Held<Panel> lamps;
  std::thread projector([&] { made.projector = darken(config.projector, clock, deadline, light); });
  std::thread panel([&] { made.panel = show_red(config.panel, clock, deadline, lamps); });
  made.turntable = stop_table(config.turntable, clock, deadline);
  projector.join();
  panel.join();
  return made;
}

ExitCode make_safe_now(const std::filesystem::path& file, const char* program, Beside beside) {
  auto config = config_to_use(file, program);
  if (config.turntable && beside == Beside::hung_daemon) {
    config.turntable->turntable.modbus.line.is_shared = true;
    config.turntable->turntable.grbl.drive.link.lock = serial::Port::Lock::shared;
  }
  RealClock clock;
  const auto made = make_safe(config, clock, Deadline::after(clock, kLimit));
  report_error(program, errors_of(made.turntable, made.projector, made.panel));
  if (!config.turntable && !config.projector && !config.panel) return exit_code(config.turntable.error().code);
  if (!made.turntable) return ExitCode::device;
  return made.projector && made.panel ? ExitCode::ok : ExitCode::partly_safe;
}

Result<void> make_safe_in_process(const std::filesystem::path& program, const std::filesystem::path& file,
                                  std::chrono::milliseconds limit) {
  std::vector<std::string> words{"scanrigd", "--make-safe", "--beside-daemon", "--config", file.string()};
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t none;
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&attributes, &none);  // the daemon blocks the signals it waits for
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t child = -1;
  const int refused = ::posix_spawn(&child, program.c_str(), nullptr, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  if (refused != 0)
    return fail(ErrorCode::io, "turntable: cannot start {}: {}", program.string(), std::strerror(refused));

  RealClock clock;
  const auto code = wait_for_end(child, clock, Deadline::after(clock, limit));
  if (!code)
    return fail(ErrorCode::timeout, "turntable: the process that stops it did not end within {} ms", limit.count());
  if (*code == static_cast<int>(ExitCode::ok) || *code == static_cast<int>(ExitCode::partly_safe)) return {};
  return fail(ErrorCode::device_alarm, "turntable: another process could not stop it (exit code {})", *code);
}

}  // namespace scanrig
