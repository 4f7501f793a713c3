#include "daemon/ctl/watch.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "core/clock.h"
#include "core/signal_stop.h"
#include "daemon/ctl/job_view.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l", kLeave = "\x1b[?25h\x1b[?1049l";

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

int points(std::string_view text) {
  return static_cast<int>(std::ranges::count_if(text, [](char c) { return !is_continuation(c); }));
}

/// The bytes of the first `width` letters.
std::size_t bytes_of(std::string_view text, int width) {
  std::size_t i = 0;
  for (int seen = 0; i < text.size(); ++i) {
    if (!is_continuation(text[i]) && ++seen > width) break;
  }
  return i;
}

/// A line that is too long continues below, further in; it is broken between words where possible.
void wrap(std::string_view line, int width, std::vector<std::string>& lines) {
  const auto indent = std::min<std::size_t>(line.find_first_not_of(' '), static_cast<std::size_t>(width) / 4);
  std::string margin;
  while (margin.size() + static_cast<std::size_t>(points(line)) > static_cast<std::size_t>(width)) {
    const auto room = width - static_cast<int>(margin.size());
    const auto most = bytes_of(line, room);
    auto end = line.rfind(' ', most);
    if (end == std::string_view::npos || line.find_first_not_of(' ') >= end) end = most;
    lines.push_back(margin + std::string(line.substr(0, end)));
    line.remove_prefix(std::min(line.find_first_not_of(' ', end), line.size()));
    margin.assign(std::min<std::size_t>(indent + 2, static_cast<std::size_t>(width) / 2), ' ');
  }
  if (!line.empty() || margin.empty()) lines.push_back(margin + std::string(line));
}

bool is_terminal(std::FILE* out) {
  const char* kind = std::getenv("TERM");
  return ::isatty(::fileno(out)) == 1 && kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb";
}

Window window_of(std::FILE* out) {
  winsize size{};
  if (::ioctl(::fileno(out), TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_col, size.ws_row};
}

void write(std::FILE* out, std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), out);
  std::fflush(out);
}

}  // namespace

std::vector<std::string> fitted(const std::vector<std::string>& lines, Window window) {
  const auto width = std::max(window.width, 1);
  const auto room = static_cast<std::size_t>(std::max(window.height, 1));
  std::vector<std::string> fit;
  for (const auto& line : lines) wrap(line, width, fit);
  if (fit.size() <= room) return fit;
  const auto missing = fmt::format("({} more lines)", fit.size() - room + 1);
  fit.resize(room - 1);
  fit.push_back(missing.substr(0, bytes_of(missing, width)));
  return fit;
}

Screen::Screen(std::FILE* out) : out_(out), terminal_(is_terminal(out)) {
  if (terminal_) write(out_, kEnter);
}

Screen::~Screen() {
  if (terminal_) write(out_, kLeave);
}

void Screen::show(const std::vector<std::string>& lines) {
  std::string text;
  if (terminal_) {
    const auto window = window_of(out_);
    const auto fit = fitted(lines, window);
    if (fit == shown_) return;
    for (std::size_t i = 0; i < fit.size(); ++i) {
      text += (i == 0 ? "\x1b[H" : "\r\n") + fit[i];
      // After a full line the cursor is still on its last letter, which would be erased.
      if (points(fit[i]) < window.width) text += "\x1b[K";
    }
    const bool full = !fit.empty() && points(fit.back()) >= window.width;
    if (!full) {
      text += "\x1b[J";
    } else if (fit.size() < static_cast<std::size_t>(window.height)) {
      text += "\r\n\x1b[J";
    }
    shown_ = fit;
  } else {
    for (const auto& line : lines) {
      if (std::ranges::find(shown_, line) == shown_.end()) text += line + "\n";
    }
    shown_ = lines;
  }
  write(out_, text);
}

namespace {

using nlohmann::json;

constexpr auto kRedrawPeriod = std::chrono::milliseconds(250);
constexpr auto kGlancePatience = std::chrono::seconds(3);  ///< a hanging daemon must show soon

tl::expected<json, RequestError> glance(const Connection& connection, const std::string& target) {
  return send_request(connection.socket, "GET", "/api/v1/" + target, "", kGlancePatience);
}

void add_health(const json& health, std::vector<std::string>& lines) {
  lines.push_back("");
  for (const auto& device : health.at("devices")) {
    const bool there = device.at("ok").get<bool>();
    lines.push_back(
        fmt::format("{:<10} {}", text(device, "name"), there ? "there" : text(device.at("problem"), "message")));
  }
  std::string machine = fmt::format("disk {} free", bytes_text(health.at("disk").at("free_bytes")));
  for (const auto& one : health.at("temperatures")) {
    machine += fmt::format(", {} {:.0f} C", text(one, "sensor"), one.at("celsius").get<double>());
  }
  lines.push_back(machine);
  lines.push_back(fmt::format("{} deadlines missed, {} exposures retried, {} faults",
                              health.at("deadlines_missed").get<int>(), health.at("retakes").get<int>(),
                              health.at("faults").get<int>()));
}

/// Null where there is none.
tl::expected<json, RequestError> job_to_show(const Connection& connection, const json& status) {
  auto id = text(status, "job");
  if (id.empty()) {
    const auto page = glance(connection, "jobs?limit=1");
    if (!page) return tl::unexpected(page.error());
    if (page->at("jobs").empty()) return json();
    id = text(page->at("jobs")[0], "id");
  }
  auto job = glance(connection, "jobs/" + segment(id));
  if (!job && job.error().exit == ExitCode::bad_input) return json();  // gone in between
  return job;
}

tl::expected<std::vector<std::string>, RequestError> look(const Connection& connection) {
  const auto status = glance(connection, "status");
  if (!status) return tl::unexpected(status.error());
  const auto health = glance(connection, "health");
  if (!health) return tl::unexpected(health.error());
  const auto job = job_to_show(connection, *status);
  if (!job) return tl::unexpected(job.error());
  if (!connection.json) return watch_lines(*status, *health, *job);
  auto both = *status;
  both.erase("revision");  // it changes when nothing else does
  return std::vector{json{{"status", both}, {"job", *job}}.dump(-1, ' ', false, json::error_handler_t::replace)};
}

/// A line a change, for programs.
void tell(const std::vector<std::string>& lines, std::string& told) {
  if (lines.at(0) == told) return;
  told = lines[0];
  fmt::print("{}\n", told);
  std::fflush(stdout);
}

}  // namespace

std::vector<std::string> watch_lines(const json& status, const json& health, const json& job) {
  std::vector<std::string> lines{fmt::format("{}  ({})", text(status, "machine"), text(status, "activity")),
                                 text(status, "sentence"), "because: " + text(status, "cause")};
  if (const auto action = text(status, "next_action"); !action.empty()) lines.push_back("next:    " + action);
  if (status.at("may_be_moving").get<bool>()) lines.push_back("THE TABLE MAY BE MOVING");
  if (const auto queued = status.value("queue", json::array()); !queued.empty()) {
    lines.push_back(fmt::format("queued:  {} jobs, next {}", queued.size(), queued[0].get<std::string>()));
  }
  if (job.is_object()) {
    lines.push_back("");
    for (auto& line : job_lines(job)) lines.push_back(std::move(line));
  }
  add_health(health, lines);
  return lines;
}

/// Waits for a daemon that has ended: its return is what the user wants to see.
ExitCode watch(const Connection& connection) {
  const SignalStop stop;
  RealClock clock;
  std::optional<Screen> screen;
  std::string told;
  bool ever = false;
  for (; !stop.token().stop_requested(); clock.sleep_for(kRedrawPeriod)) {
    const auto lines = look(connection);
    if (!lines && (!ever || connection.json)) return report_error(lines.error());
    ever = true;
    if (connection.json) {
      tell(*lines, told);
    } else {
      if (!screen) screen.emplace(stdout);
      screen->show(lines ? *lines : std::vector{lines.error().message, std::string("Trying again. Ctrl-C ends this.")});
    }
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
