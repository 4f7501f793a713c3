#include <unistd.h>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "core/secrets.h"
#include "daemon/ctl/client.h"
#include "daemon/ctl/job_view.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"
#include "daemon/station/states.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

constexpr auto kPoll = std::chrono::milliseconds(100);
constexpr auto kLookAtBoard = std::chrono::milliseconds(500);
constexpr auto kStandstillTimeout = std::chrono::seconds(10);  ///< the service gives the drive less

/// `id` empty: the active job, now or as soon as there is one.
ExitCode follow(const Connection& connection, std::string id) {
  RealClock clock;
  std::FILE* told = connection.json ? stderr : stdout;
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  JobStory story(bars);
  for (;; clock.sleep_for(kPoll)) {
    const auto status = send_request(connection.socket, "GET", "/api/v1/status");
    if (!status) return report_error(status.error());
    if (id.empty()) id = text(*status, "job");
    if (id.empty()) {
      story.wait(*status);
      continue;
    }
    if (const auto why = why_not_started(*status, id)) return report_error(*why);
    const auto job = send_request(connection.socket, "GET", "/api/v1/jobs/" + id);
    if (!job && job.error().exit == exit_code(ErrorCode::not_found) && text(*status, "job") == id) continue;  // not yet
    if (!job) return report_error(job.error());
    if (!story.tell(*status, *job)) continue;
    if (connection.json) print(*job);
    return story.end(*job);
  }
}

}  // namespace

ExitCode status(const Connection& connection, const StatusVerb& verb) {
  if (verb.watch) return watch(connection);
  if (verb.follow) return follow(connection, "");
  const auto answer = send_request(connection.socket, "GET", "/api/v1/status");
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
    return ExitCode::ok;
  }
  fmt::print("{}: {}\n  because: {}\n", text(*answer, "machine"), text(*answer, "sentence"), text(*answer, "cause"));
  for (const auto& device : answer->at("devices")) {
    if (!device.at("ok").get<bool>()) fmt::print("  absent: {}\n", text(device.at("problem"), "message"));
  }
  if (const auto action = text(*answer, "next_action"); !action.empty()) fmt::print("  next: {}\n", action);
  if (const auto job = text(*answer, "job"); !job.empty()) fmt::print("  job: {}\n", job);
  return ExitCode::ok;
}

ExitCode health(const Connection& connection) {
  const auto answer = send_request(connection.socket, "GET", "/api/v1/health");
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
    return ExitCode::ok;
  }
  fmt::print("{}\n", answer->at("ok").get<bool>() ? "nothing is wrong" : "problems:");
  for (const auto& problem : answer->at("problems")) fmt::print("  {}\n", text(problem, "message"));
  for (const auto& reminder : answer->at("reminders")) fmt::print("{}\n", reminder.get<std::string>());
  const auto& disk = answer->at("disk");
  fmt::print("disk: {} free of {}\n", bytes_text(disk.at("free_bytes")), bytes_text(disk.at("bytes")));
  for (const auto& one : answer->at("temperatures")) {
    fmt::print("{}: {:.1f} degrees Celsius\n", text(one, "sensor"), one.at("celsius").get<double>());
  }
  fmt::print("since {:.0f} s: {} deadlines missed, {} retakes, {} faults\n", answer->at("uptime_s").get<double>(),
             answer->at("deadlines_missed").get<int>(), answer->at("retakes").get<int>(),
             answer->at("faults").get<int>());
  return ExitCode::ok;
}

ExitCode start(const Connection& connection, const StartVerb& verb) {
  const auto answer = send_request(connection.socket, "POST", "/api/v1/start");
  if (!answer) return report_error(answer.error());
  const auto id = text(*answer, "job");
  if (verb.follow) return follow(connection, id);
  if (connection.json) {
    print(*answer);
  } else {
    fmt::print("{}\n", id);
  }
  return ExitCode::ok;
}

namespace {

/// A page that leads to `target`: a command line is everybody's to read, this file is not.
Result<std::filesystem::path> write_redirect(const std::string& target) {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::filesystem::path folder = runtime != nullptr ? runtime : "/tmp";
  auto file = folder / fmt::format("scanrig-open-{}.html", ::getpid());
  auto written = write_private_file(
      file,
      fmt::format("<!doctype html><meta http-equiv=\"refresh\" content=\"0;url={}\"><title>scanrig</title>\n", target));
  return written ? Result<std::filesystem::path>(std::move(file)) : pass_on(written);
}

/// Returns only where there is no such browser.
ExitCode become_kiosk(const std::string& browser, const std::string& target) {
  const auto file = write_redirect(target);
  if (!file) return report_error(exit_code(file.error().code), file.error().message);
  const auto address = "file://" + file->string();
  ::execlp(browser.c_str(), browser.c_str(), "--kiosk", "--no-first-run", address.c_str(), nullptr);
  return report_error(exit_code(ErrorCode::not_found),
                      fmt::format("cannot start {}: install it, or name another --browser", browser));
}

}  // namespace

ExitCode open_page(const Connection& connection, const OpenVerb& verb) {
  const auto answer = send_request(connection.socket, "POST", "/api/v1/login/code",
                                   json{{"role", verb.role}, {"kiosk", verb.kiosk}}.dump());
  if (!answer) return report_error(answer.error());
  const auto address = text(*answer, "address");
  if (address.empty()) {
    return report_error(exit_code(ErrorCode::refused), "the page is not served: set http_port in [api] of rig.toml");
  }
  const auto target = fmt::format("{}/#code={}", address, text(*answer, "code"));
  if (verb.kiosk) return become_kiosk(verb.browser, target);
  if (connection.json) {
    print(*answer);
  } else {
    fmt::print("{}\nvalid once, for {} minutes, as {}\n", target, answer->at("valid_s").get<int>() / 60, verb.role);
  }
  return ExitCode::ok;
}

ExitCode stop(const Connection& connection, const StopVerb& verb) {
  const auto stopped = send_request(connection.socket, "POST", "/api/v1/stop");
  if (!stopped) return report_error(stopped.error());
  if (!connection.json) {
    fmt::print("{}\n", text(*stopped, "sent"));
    if (const auto job = text(*stopped, "job"); !job.empty()) fmt::print("Job {} is interrupted.\n", job);
  }
  RealClock clock;
  const auto deadline = Deadline::after(clock, kStandstillTimeout);
  auto standstill = text(*stopped, "standstill");
  while (verb.wait && standstill == "pending" && !deadline.expired(clock)) {
    clock.sleep_for(kPoll);
    const auto status = send_request(connection.socket, "GET", "/api/v1/status");
    if (!status) return report_error(ExitCode::standstill_unknown, "stop was sent, but " + status.error().message);
    standstill = text(*status, "standstill");
  }
  const bool confirmed = standstill == "confirmed" || standstill == "moving";  // it moves again: it had stopped
  if (connection.json) {
    auto reply = *stopped;
    reply["standstill"] = standstill;
    print(reply);
  } else if (confirmed) {
    fmt::print("The table has stopped.\n");
  }
  if (confirmed) return ExitCode::ok;
  return report_error(ExitCode::standstill_unknown,
                      standstill == "pending"
                          ? "standstill is not confirmed yet; run scanrig status"
                          : "the table may be moving: keep clear, check the drive's power and cable");
}

ExitCode press(const Connection& connection, const std::string& button) {
  const auto answer = send_request(connection.socket, "POST", "/api/v1/" + button);
  if (!answer) return report_error(answer.error());
  if (connection.json) print(*answer);
  return ExitCode::ok;
}

namespace {

/// Lines of a calibration as they become true, and one that is kept up to date while the board is put in place.
class CalibrationStory {
 public:
  CalibrationStory(std::FILE* out, bool terminal) : out_(out), terminal_(terminal) {}

  /// `calibration`: as GET calibration gives it, `status` as GET status.
  void tell(const json& calibration, const json& status) {
    const auto& job = calibration.at("job");
    for (const auto& view : job.at("views")) tell_view(view);
    const bool waits = calibration.at("awaited_placement").is_number();
    line(text(status, "sentence") + (waits ? "\n  " + text(status, "next_action") : ""));
    const auto& board = calibration.at("board");
    if (waits && board.is_object()) live(text(board, "sentence"));
  }
  void end(const json& job) {
    line(text(job, "sentence") + "\n  " + text(job, "next_action"));
    clear();
  }

 private:
  void tell_view(const json& view) {
    const auto name =
        fmt::format("  placement {} view {}", view.at("placement").get<int>(), view.at("view").get<int>());
    for (const auto& problem : view.at("problems")) {
      const auto words = fmt::format("{}: {}", name, problem.get<std::string>());
      if (told_.insert(words).second) print(words);
    }
  }
  void line(const std::string& words) {
    if (words == last_) return;
    last_ = words;
    print(words);
  }
  void print(const std::string& words) {
    clear();
    fmt::print(out_, "{}\n", words);
    std::fflush(out_);
  }
  void live(const std::string& words) {
    if (words == live_) return;
    if (!terminal_) fmt::print(out_, "  {}\n", words);
    if (terminal_) fmt::print(out_, "\r\033[K  {}", words);
    live_ = words;
    std::fflush(out_);
  }
  void clear() {
    if (terminal_ && !live_.empty()) fmt::print(out_, "\r\033[K");
    live_.clear();
  }

  std::FILE* out_;
  const bool terminal_;
  std::string last_, live_;
  std::set<std::string> told_;
};

ExitCode follow_calibration(const Connection& connection, const std::string& id) {
  RealClock clock;
  std::FILE* out = connection.json ? stderr : stdout;
  CalibrationStory story(out, ::isatty(::fileno(out)) == 1);
  for (;; clock.sleep_for(kLookAtBoard)) {
    const auto status = send_request(connection.socket, "GET", "/api/v1/status");
    if (!status) return report_error(status.error());
    if (const auto why = why_not_started(*status, id)) return report_error(*why);
    const auto calibration = send_request(connection.socket, "GET", "/api/v1/calibration");
    if (!calibration) return report_error(calibration.error());
    const auto& job = calibration->at("job");
    if (!job.is_object() || text(job, "id") != id)
      return report_error(ExitCode::refused, "the calibration was deleted");
    const auto state = parse_job_state(text(job, "state"));
    if (!state || !is_final(*state)) {
      story.tell(*calibration, *status);
      continue;
    }
    if (connection.json) print(job);
    if (*state == JobState::done) {
      if (!connection.json) story.end(job);
      return ExitCode::ok;
    }
    const auto ended = send_request(connection.socket, "GET", "/api/v1/jobs/" + segment(id));
    if (!ended) return report_error(ended.error());
    const auto& why = ended->at("error");
    const auto code = why.is_object() ? parse_error_code(text(why, "code")) : std::nullopt;
    return report_error({code.value_or(ErrorCode::internal), text(job, "sentence") + " " + text(job, "next_action")});
  }
}

/// The calibration that is queued or active; empty: none is.
tl::expected<std::string, RequestError> unfinished_calibration(const Connection& connection) {
  const auto calibration = send_request(connection.socket, "GET", "/api/v1/calibration");
  if (!calibration) return tl::unexpected(calibration.error());
  const auto& job = calibration->at("job");
  const auto state = job.is_object() ? parse_job_state(text(job, "state")) : std::nullopt;
  return state && !is_final(*state) ? text(job, "id") : std::string();
}

}  // namespace

ExitCode calibrate(const Connection& connection, const CalibrateVerb& verb) {
  const bool follows = verb.rig || verb.check;
  if (!follows && !verb.accept && !verb.abort) {
    return report_error(ExitCode::usage, "calibrate needs --rig, --check, --accept, --abort or a folder of images");
  }
  if (follows) {
    const auto unfinished = unfinished_calibration(connection);
    if (!unfinished) return report_error(unfinished.error());
    if (!unfinished->empty()) return follow_calibration(connection, *unfinished);
  }
  const char* const what = verb.rig ? "begin" : verb.check ? "check" : verb.accept ? "accept" : "abort";
  const auto answer = send_request(connection.socket, "POST", std::string("/api/v1/calibration/") + what);
  if (!answer) return report_error(answer.error());
  if (follows) return follow_calibration(connection, text(*answer, "job"));
  if (connection.json) print(*answer);
  if (!connection.json) fmt::print("{} is {}.\n", text(*answer, "job"), verb.accept ? "accepted" : "cancelled");
  return ExitCode::ok;
}

namespace {

void print_io(const nlohmann::json& io) {
  for (const char* side : {"inputs", "outputs"}) {
    fmt::print("{}\n", side);
    for (const auto& [name, value] : io.at(side).items()) fmt::print("  {:<14} {}\n", name, value.get<bool>() ? 1 : 0);
  }
}

std::string body_of(const MaintenanceVerb& verb) {
  if (verb.what != "jog") return "";
  const bool to = verb.to_deg.has_value();
  return nlohmann::json{{to ? "to_deg" : "by_deg", to ? *verb.to_deg : verb.by_deg.value_or(0.0)},
                        {"speed_deg_s", verb.speed_deg_s}}
      .dump();
}

}  // namespace

ExitCode maintenance(const Connection& connection, const MaintenanceVerb& verb) {
  const bool io = verb.what == "io";
  if (verb.what == "jog" && verb.to_deg.has_value() == verb.by_deg.has_value()) {
    return report_error(ExitCode::usage, "maintenance jog needs --to or --by");
  }
  const auto answer = io ? send_request(connection.socket, "GET", "/api/v1/io")
                         : send_request(connection.socket, "POST", "/api/v1/maintenance/" + verb.what, body_of(verb));
  if (!answer) return report_error(answer.error().exit, answer.error().message);
  if (connection.json) {
    fmt::print("{}\n", answer->dump(2));
  } else if (io) {
    print_io(*answer);
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
