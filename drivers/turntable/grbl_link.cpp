#include "drivers/turntable/grbl_link.h"

#include <algorithm>

namespace scanrig::grbl {
namespace {

using std::chrono::milliseconds;
using Kind = Line::Kind;

constexpr std::size_t kMaxLineLength = 200;
constexpr milliseconds kRestart{1500};              ///< from a reset to the greeting
constexpr Clock::Duration kLook = milliseconds(5);  ///< longest time until a waiting caller notices set_fail_fast()
constexpr char kReset = 0x18;

}  // namespace

tl::unexpected<Error> Link::lost(const Error& error) {
  if (error.code == ErrorCode::io) {
    port_.reset();
    heard_.clear();
    reply_missed_ = true;
    ++statistics_.io_errors;
  }
  return tl::unexpected(error);
}

Result<void> Link::open() {
  auto port = serial::Port::open(options_.device, options_.baud, options_.lock);
  if (!port) return lost(port.error());
  port_.emplace(std::move(*port));
  heard_.clear();
  ++statistics_.openings;
  reply_missed_ = true;  // earlier output of the controller is not for this request
  return {};
}

/// Reads the next whole line; empty lines are skipped.
Result<std::optional<Line>> Link::next_line(Clock::Duration wait) {
  for (const auto until = clock_.now() + wait;;) {
    const auto end = heard_.find_first_of("\r\n");
    if (end != std::string::npos || heard_.size() > kMaxLineLength) {
      const std::string text = heard_.substr(0, end);
      heard_.erase(0, end == std::string::npos ? end : end + 1);
      if (text.empty()) continue;
      Line line = parse_line(text);
      if (line.kind == Kind::alarm) alarm_ = line.number;
      if (line.kind == Kind::banner) restarted_ = true;
      if (line.firmware) firmware_ = *line.firmware;
      return line;
    }
    const auto left = until - clock_.now();
    const auto bytes = port_->read(std::clamp<Clock::Duration>(left, Clock::Duration::zero(), kLook));
    if (!bytes) return lost(bytes.error());
    if (bytes->empty() && clock_.now() >= until) return std::nullopt;
    heard_ += *bytes;
  }
}

Result<void> Link::wait_until_quiet(Deadline deadline) {
  const auto silence = 2 * options_.reply_timeout;
  for (auto quiet_at = clock_.now() + silence; clock_.now() < quiet_at;) {
    if (deadline.expired(clock_)) {
      return fail(ErrorCode::timeout, "{}: bus not quiet in time", options_.device);
    }
    if (fail_fast_) return fail(ErrorCode::stopped, "{}: cancelled while waiting for a quiet bus", options_.device);
    const auto line = next_line(std::min<Clock::Duration>(quiet_at - clock_.now(), kLook));
    if (!line) return pass_on(line);
    if (*line) quiet_at = clock_.now() + silence;
  }
  heard_.clear();
  reply_missed_ = false;
  return {};
}

Result<void> Link::send(std::string_view bytes, Deadline deadline) {
  if (!port_) {
    if (auto opened = open(); !opened) return opened;
  }
  for (;;) {
    const auto unasked = next_line(Clock::Duration::zero());
    if (!unasked) return pass_on(unasked);
    if (!*unasked) break;
    const Kind kind = (*unasked)->kind;
    if (kind == Kind::alarm || kind == Kind::banner || kind == Kind::message) continue;
    reply_missed_ = true;
    ++statistics_.corrupt;
  }
  if (reply_missed_) {
    if (auto quiet = wait_until_quiet(deadline); !quiet) return quiet;
  }
  if (deadline.expired(clock_)) {
    return fail(ErrorCode::timeout, "{}: the deadline passed before it could be asked", options_.device);
  }
  ++statistics_.requests;
  reply_missed_ = true;  // until the reply has arrived
  if (auto sent = port_->write(bytes, options_.reply_timeout); !sent) return lost(sent.error());
  return {};
}

Result<Line> Link::answer(std::string_view to, const std::function<bool(const Line&)>& wanted, Deadline deadline) {
  const auto until = deadline.at_most(clock_, options_.reply_timeout);
  for (;;) {
    const auto line = next_line(until.left(clock_));
    if (!line) return pass_on(line);
    if (!*line) {
      ++statistics_.timeouts;
      const auto& finding = port_->finding();
      return fail(ErrorCode::timeout, "{}: no complete reply to \"{}\" within {} ms; check power, wiring and baud{}",
                  options_.device, to, options_.reply_timeout.count(), finding ? "; " + *finding : "");
    }
    if (wanted(**line)) {
      reply_missed_ = false;
      return **line;
    }
    const Kind kind = (*line)->kind;
    if (kind == Kind::alarm || kind == Kind::banner || kind == Kind::message) continue;
    ++statistics_.corrupt;
    return fail(ErrorCode::protocol, "{}: unusable answer to \"{}\"", options_.device, to);
  }
}

Result<void> Link::command(std::string_view line, Deadline deadline) {
  restarted_ = false;
  if (auto sent = send(std::string(line) + "\n", deadline); !sent) return sent;
  const auto end = answer(
      line,
      [](const Line& l) {
        return l.kind == Kind::ok || l.kind == Kind::error || l.kind == Kind::alarm || l.kind == Kind::banner;
      },
      deadline);
  if (!end) return pass_on(end);
  switch (end->kind) {
    case Kind::error:
      ++statistics_.refused;
      return fail(ErrorCode::protocol, "{}: the controller refused \"{}\": {}", options_.device, line,
                  error_words(end->number, firmware_));
    case Kind::alarm:
      return fail(ErrorCode::device_alarm, "the controller reports {}", alarm_of(end->number, firmware_).words);
    case Kind::banner:
      return fail(ErrorCode::not_homed, "the controller restarted (power, reset button): its zero is gone");
    default: return {};
  }
}

Result<void> Link::begin(std::string_view line, Deadline deadline) {
  if (auto sent = send(std::string(line) + "\n", deadline); !sent) return sent;
  reply_missed_ = false;  // it is not late before the line has been carried out
  return {};
}

Result<std::optional<Line>> Link::listen(Clock::Duration wait) {
  if (!port_) return fail(ErrorCode::io, "{}: the port is not open", options_.device);
  return next_line(wait);
}

Result<Report> Link::report(Deadline deadline) {
  if (auto sent = send("?", deadline); !sent) return pass_on(sent);
  auto line = answer(
      "?", [](const Line& l) { return l.kind == Kind::report; }, deadline);
  if (!line) return pass_on(line);
  return std::move(line->report);
}

Result<void> Link::probe(Deadline deadline) {
  if (auto sent = send("#\n", deadline); !sent) return sent;
  const auto refused = answer(
      "#", [](const Line& l) { return l.kind == Kind::error; }, deadline);
  if (!refused) return pass_on(refused);
  return {};
}

Result<void> Link::identify(Deadline deadline) {
  if (auto sent = send("$I\n", deadline); !sent) return sent;
  const auto end = answer(
      "$I", [](const Line& l) { return l.kind == Kind::ok || l.kind == Kind::error; }, deadline);
  if (!end) return pass_on(end);
  return {};
}

Result<std::map<int, double>> Link::settings(Deadline deadline) {
  if (auto sent = send("$$\n", deadline); !sent) return pass_on(sent);
  std::map<int, double> all;
  for (;;) {
    const auto line = answer(
        "$$", [](const Line& l) { return l.kind == Kind::setting || l.kind == Kind::ok; }, deadline);
    if (!line) return pass_on(line);
    if (line->kind == Kind::ok) return all;
    all[line->number] = line->value;
    reply_missed_ = true;  // the list continues
  }
}

Result<void> Link::at_once(char byte) {
  if (!port_) {
    if (auto opened = open(); !opened) return opened;
  }
  ++statistics_.requests;
  if (auto sent = port_->write({&byte, 1}, options_.reply_timeout); !sent) return lost(sent.error());
  return {};
}

Result<void> Link::reset(Deadline deadline) {
  if (auto sent = at_once(kReset); !sent) return sent;
  for (const auto by = deadline.at_most(clock_, kRestart); !by.expired(clock_) && !fail_fast_;) {
    const auto line = next_line(std::min(by.left(clock_), kLook));
    if (!line) return pass_on(line);
    if (!*line || (*line)->kind != Kind::banner) continue;
    restarted_ = false;
    reply_missed_ = true;  // output after its greeting is not for the next request
    return {};
  }
  ++statistics_.timeouts;
  return fail(ErrorCode::timeout, "{}: not heard to restart after a reset; check power, wiring and baud",
              options_.device);
}

}  // namespace scanrig::grbl
