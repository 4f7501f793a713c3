#include "drivers/panel/debounce.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace scanrig {
namespace {

using Field = bool PanelInputs::*;

bool is_button(Field field) {
  return field == &PanelInputs::start || field == &PanelInputs::stop || field == &PanelInputs::reset;
}

/// An opened safety contact must not wait for the debouncing.
bool is_safety(Field field) { return field == &PanelInputs::estop_ok || field == &PanelInputs::guard_closed; }

const char* name_of(Field field) {
  if (field == &PanelInputs::start) return "Start";
  return field == &PanelInputs::stop ? "Stop" : "Reset";
}

Clock::Duration must_hold(Field field, bool level) {
  const bool starts_something = field == &PanelInputs::start || field == &PanelInputs::reset;
  return level && starts_something ? PanelDebounce::kMinimumPress : PanelDebounce::kDebounce;
}

}  // namespace

PanelDebounce::PanelDebounce(const std::vector<Field>& fields) {
  for (const Field field : fields) inputs_.push_back({field});
}

void PanelDebounce::take(const std::vector<bool>& levels, Clock::TimePoint now) {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    Input& input = inputs_[i];
    if (first_) {
      input = {input.field, levels[i], levels[i], levels[i] && is_button(input.field), now};
      continue;
    }
    if (levels[i] != input.level) {
      input.level = levels[i];
      input.since = now;
    }
    const bool held = now - input.since >= must_hold(input.field, input.level);
    if (held || (is_safety(input.field) && !input.level)) input.settled = input.level;
    if (!input.settled) input.stuck = false;
  }
  first_ = false;
}

PanelInputs PanelDebounce::settled() const {
  PanelInputs now;
  for (const Input& input : inputs_) now.*input.field = input.settled && !input.stuck;
  return now;
}

std::optional<Clock::TimePoint> PanelDebounce::due() const {
  std::optional<Clock::TimePoint> earliest;
  for (const Input& input : inputs_) {
    if (input.level == input.settled) continue;
    const auto counts = input.since + must_hold(input.field, input.level);
    earliest = std::min(earliest.value_or(counts), counts);
  }
  return earliest;
}

Result<void> PanelDebounce::none_stuck() const {
  std::vector<std::string> stuck;
  for (const Input& input : inputs_) {
    if (input.stuck) stuck.emplace_back(name_of(input.field));
  }
  if (stuck.empty()) return {};
  return fail(ErrorCode::device_alarm, "panel: {} held since start-up; release or free it", fmt::join(stuck, " and "));
}

}  // namespace scanrig
