#include "drivers/turntable/grbl_protocol.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <utility>

namespace scanrig::grbl {
namespace {

constexpr std::array<std::pair<std::string_view, State>, 10> kStates{{{"Idle", State::idle},
                                                                      {"Run", State::run},
                                                                      {"Hold", State::hold},
                                                                      {"Jog", State::jog},
                                                                      {"Alarm", State::alarm},
                                                                      {"Door", State::door},
                                                                      {"Check", State::check},
                                                                      {"Home", State::home},
                                                                      {"Sleep", State::sleep},
                                                                      {"Tool", State::tool}}};
constexpr std::size_t kMaxAxes = 9;

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
    // Hold:0 and Door:0 (closed), Door:1 (open): stopped. Hold:1, Door:2, Door:3: not yet. Others are grblHAL's.
    const auto part = number<int>(first);
    if (!part || *part < 0) return std::nullopt;
    report.underway = report.state == State::hold ? *part != 0 : report.state == State::door && *part >= 2;
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

std::optional<Firmware> named_in(std::string_view text) {
  if (text.find("FluidNC") != std::string_view::npos) return Firmware::fluidnc;
  if (text.starts_with("GrblHAL ") || text == "[FIRMWARE:grblHAL]") return Firmware::grblhal;
  return std::nullopt;  // grblHAL, too, greets as "Grbl 1.1f" where it is built so
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
  if (text == "ok") return {.kind = Kind::ok};
  if (const auto code = after(text, "error:")) return {.kind = Kind::error, .number = *code};
  if (const auto code = after(text, "ALARM:")) return {.kind = Kind::alarm, .number = *code};
  if (text.starts_with("Grbl ") || text.starts_with("GrblHAL ")) {
    return {.kind = Kind::banner, .firmware = named_in(text)};
  }
  if (text.size() > 2 && text.front() == '[' && text.back() == ']') {
    const bool names = text.starts_with("[VER:") || text.starts_with("[FIRMWARE:");
    return {.kind = Kind::message, .firmware = names ? named_in(text) : std::nullopt};
  }
  if (text.size() > 2 && text.front() == '<' && text.back() == '>') {
    if (auto report = parse_report(text.substr(1, text.size() - 2)))
      return {.kind = Kind::report, .report = std::move(*report)};
  }
  if (text.starts_with('$')) {
    auto rest = text.substr(1);
    const bool has_value = rest.find('=') != std::string_view::npos;
    const auto name = number<int>(take(rest, '='));
    if (name && *name >= 0 && has_value)
      return {.kind = Kind::setting, .number = *name, .value = real(rest).value_or(std::nan(""))};
  }
  return {};
}

namespace {

struct KnownAlarm {
  int number;
  std::string_view words;
  bool wants_reset = false, switch_not_found = false;
};

/// Of every firmware.
constexpr std::array<KnownAlarm, 9> kAlarms{
    {{1, "a limit switch was hit, the position may be lost: see what is in the way", true},
     {2,
      "the move leads beyond the controller's own limits: switch its soft limits off ($20=0) for a table that turns "
      "round",
      true},
     {3, "reset while moving, the position is lost"},
     {4, "the probe was not in its initial state", true},
     {5, "the probe was not touched", true},
     {6, "homing was broken off by a reset"},
     {7, "homing was broken off: the safety door was opened"},
     {8, "homing: the switch did not open again when backing off: check the switch and $27", false, true},
     {9, "homing: the switch was not reached: is the table blocked, the switch's cable broken?", false, true}}};
constexpr std::array<KnownAlarm, 1> kGrblAlarms{
    {{10, "homing: the second motor's switch was not reached", false, true}}};
constexpr std::array<KnownAlarm, 9> kGrblHalAlarms{
    {{10, "its emergency stop input is open: release the e-stop, or set the input up", true},
     {11, "it must be homed"},
     {12, "a limit switch is engaged: free it", true},
     {13, "the probe is touched: free it", true},
     {14, "the spindle does not reach its speed", true},
     {15, "homing: the second motor's switch was not reached", false, true},
     {16, "its self-test failed: switch it off and on", true},
     {17, "a motor's driver reports a fault: check the motor and its cable", true},
     {18, "homing is not possible as it is set up: check $23, $24, $25 and $44", true}}};
constexpr std::array<KnownAlarm, 9> kFluidNcAlarms{
    {{10, "the spindle does not obey", true},
     {11, "a control or limit input is active at its start: free it, or check the input's pin", true},
     {12, "homing: both limit switches of an axis are active: check their cables", true},
     {13, "it was stopped hard, the position is lost", true},
     {14, "it must be homed"},
     {15, "it has started"},
     {16, "its I/O expander restarted: check the expander's cable", true},
     {17, "a line of G-code was refused", true},
     {18, "the probe met a limit switch", true}}};

std::span<const KnownAlarm> own_alarms(Firmware firmware) {
  switch (firmware) {
    case Firmware::grblhal: return kGrblHalAlarms;
    case Firmware::fluidnc: return kFluidNcAlarms;
    case Firmware::grbl: break;
  }
  return kGrblAlarms;
}

/// What grblHAL adds to GRBL's errors.
std::string_view grblhal_error(int number) {
  switch (number) {
    case 45: return "a limit switch is engaged: free it";
    case 46: return "home it first";
    case 49: return "its self-test failed: switch it off and on";
    case 50: return "its emergency stop input is open: release the e-stop, or set the input up";
    case 51: return "a motor's driver reports a fault: check the motor and its cable";
    default: return {};
  }
}

}  // namespace

std::string_view name_of(Firmware firmware) {
  switch (firmware) {
    case Firmware::grblhal: return "grblHAL";
    case Firmware::fluidnc: return "FluidNC";
    case Firmware::grbl: break;
  }
  return "GRBL 1.1";
}

Alarm alarm_of(int number, Firmware firmware) {
  for (const auto known : {std::span<const KnownAlarm>(kAlarms), own_alarms(firmware)}) {
    const auto one = std::ranges::find(known, number, &KnownAlarm::number);
    if (one != known.end())
      return {fmt::format("{} (ALARM:{})", one->words, number), one->wants_reset, one->switch_not_found};
  }
  return {fmt::format("ALARM:{}, unknown to {}: see the controller's manual", number, name_of(firmware)), number > 0,
          false};
}

std::string error_words(int number, Firmware firmware) {
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
  std::string_view words;
  if (number >= 1 && number <= static_cast<int>(kWords.size())) words = kWords[static_cast<std::size_t>(number - 1)];
  if (firmware == Firmware::grblhal && words.empty()) words = grblhal_error(number);
  if (words.empty())
    return fmt::format("error:{}, unknown to {}: see the controller's manual", number, name_of(firmware));
  return fmt::format("{} (error:{})", words, number);
}

std::string_view name_of(State state) {
  const auto known = std::ranges::find(kStates, state, &std::pair<std::string_view, State>::second);
  return known == kStates.end() ? "unknown" : known->first;
}

}  // namespace scanrig::grbl
