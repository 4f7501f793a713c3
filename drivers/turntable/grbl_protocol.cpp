#include "drivers/turntable/grbl_protocol.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace scanrig::grbl {
namespace {

constexpr std::array<std::pair<std::string_view, State>, 9> kStates{{{"Idle", State::idle},
                                                                     {"Run", State::run},
                                                                     {"Hold", State::hold},
                                                                     {"Jog", State::jog},
                                                                     {"Alarm", State::alarm},
                                                                     {"Door", State::door},
                                                                     {"Check", State::check},
                                                                     {"Home", State::home},
                                                                     {"Sleep", State::sleep}}};
constexpr std::size_t kMaxAxes = 6;

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> real(std::string_view text) {
  const auto value = number<double>(text);
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return value;
}

/// Takes the text up to `separator`, and removes the separator too.
std::string_view take(std::string_view& text, char separator) {
  const auto at = text.find(separator);
  const auto part = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return part;
}

std::optional<std::vector<double>> coordinates(std::string_view text) {
  std::vector<double> values;
  while (!text.empty()) {
    const auto value = real(take(text, ','));
    if (!value || values.size() == kMaxAxes) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

/// Parses the text between the angle brackets.
std::optional<Report> parse_report(std::string_view text) {
  auto first = take(text, '|');
  const auto word = take(first, ':');
  const auto known = std::ranges::find(kStates, word, &std::pair<std::string_view, State>::first);
  if (known == kStates.end()) return std::nullopt;
  Report report{known->second, false, {}};
  if (!first.empty()) {
    // Hold:0 and Door:0 (closed), Door:1 (open): stopped. Hold:1, Door:2, Door:3: not yet.
    const auto part = number<int>(first);
    if (!part || (report.state != State::hold && report.state != State::door)) return std::nullopt;
    report.underway = report.state == State::hold ? *part != 0 : *part >= 2;
  }
  while (!text.empty()) {
    auto field = take(text, '|');
    if (take(field, ':') != "MPos") continue;
    const auto position = coordinates(field);
    if (!position || position->empty() || !report.position.empty()) return std::nullopt;
    report.position = *position;
  }
  return report;
}

std::optional<int> after(std::string_view text, std::string_view word) {
  if (!text.starts_with(word)) return std::nullopt;
  const auto value = number<int>(text.substr(word.size()));
  if (!value || *value < 0) return std::nullopt;
  return value;
}

}  // namespace

Line parse_line(std::string_view text) {
  using Kind = Line::Kind;
  const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (!std::ranges::all_of(text, printable)) return {};
  if (text == "ok") return {Kind::ok, 0, 0.0, {}};
  if (const auto code = after(text, "error:")) return {Kind::error, *code, 0.0, {}};
  if (const auto code = after(text, "ALARM:")) return {Kind::alarm, *code, 0.0, {}};
  if (text.starts_with("Grbl ")) return {Kind::banner, 0, 0.0, {}};
  if (text.size() > 2 && text.front() == '[' && text.back() == ']') return {Kind::message, 0, 0.0, {}};
  if (text.size() > 2 && text.front() == '<' && text.back() == '>') {
    if (auto report = parse_report(text.substr(1, text.size() - 2))) return {Kind::report, 0, 0.0, std::move(*report)};
  }
  if (text.starts_with('$')) {
    auto rest = text.substr(1);
    const auto name = number<int>(take(rest, '='));
    const auto value = real(rest);
    if (name && *name >= 0 && value) return {Kind::setting, *name, *value, {}};
  }
  return {};
}

std::string alarm_words(int number) {
  static constexpr std::array<std::string_view, 10> kWords{
      "a limit switch was hit, the position may be lost: see what is in the way",
      "the move leads beyond the controller's own limits: switch its soft limits off ($20=0) for a table that turns "
      "round",
      "reset while moving, the position is lost",
      "the probe was not in its initial state",
      "the probe was not touched",
      "homing was broken off by a reset",
      "homing was broken off: the safety door was opened",
      "homing: the switch did not open again when backing off: check the switch and $27",
      "homing: the switch was not reached: is the table blocked, the switch's cable broken?",
      "homing: the second motor's switch was not reached"};
  if (number < 1 || number > static_cast<int>(kWords.size())) {
    return fmt::format("ALARM:{}, unknown to GRBL 1.1: see the controller's manual", number);
  }
  return fmt::format("{} (ALARM:{})", kWords[static_cast<std::size_t>(number - 1)], number);
}

std::string error_words(int number) {
  static constexpr std::array<std::string_view, 38> kWords{
      "a command letter was expected",
      "a number was not understood",
      "unknown $ command",
      "a negative value",
      "homing is switched off: set $22=1",
      "the step pulse is too short",
      "the settings could not be read, the defaults were restored: set the controller up again",
      "only possible while idle",
      "locked: home it first",
      "soft limits need homing: set $22=1",
      "the line is too long",
      "the step rate is too high: check steps ($100) and maximum rate ($110)",
      "the safety door is open",
      "the line is too long for the memory",
      "a jog beyond the travel",
      "a jog command was not understood",
      "laser mode needs PWM",
      "",
      "",
      "unsupported command",
      "two commands of one group",
      "no feed rate",
      "a whole number was expected",
      "two commands need the axis words",
      "a word was repeated",
      "axis words are missing",
      "the line number is out of range",
      "a value is missing",
      "no such work coordinates",
      "G53 needs G0 or G1",
      "axis words without use",
      "an arc without axis words in its plane",
      "an arc that cannot be",
      "an arc's radius is wrong",
      "an arc without offsets",
      "words without use",
      "a tool offset on the wrong axis",
      "the tool number is too high"};
  const bool known = number >= 1 && number <= static_cast<int>(kWords.size());
  if (!known || kWords[static_cast<std::size_t>(number - 1)].empty()) {
    return fmt::format("error:{}, unknown to GRBL 1.1: see the controller's manual", number);
  }
  return fmt::format("{} (error:{})", kWords[static_cast<std::size_t>(number - 1)], number);
}

std::string_view name_of(State state) {
  const auto known = std::ranges::find(kStates, state, &std::pair<std::string_view, State>::second);
  return known == kStates.end() ? "unknown" : known->first;
}

}  // namespace scanrig::grbl
