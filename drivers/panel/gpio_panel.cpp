#include "drivers/panel/gpio_panel.h"

#include <algorithm>

namespace scanrig {
namespace {

/// An opened safety contact must not wait for the debouncing.
bool is_safety(bool PanelInputs::*field) {
  return field == &PanelInputs::estop_ok || field == &PanelInputs::guard_closed;
}

}  // namespace

Result<std::unique_ptr<GpioPanel>> GpioPanel::open(const GpioPanelOptions& options, gpio::Lines& lines, Clock& clock) {
  std::unique_ptr<GpioPanel> panel(new GpioPanel(clock));
  for (const auto& [field, spec] : options.outputs) {
    auto line = lines.output(spec);
    if (!line) return pass_on(line, "panel");
    panel->lamps_.push_back({field, std::move(*line)});
  }
  std::vector<gpio::LineSpec> specs;
  for (const auto& [field, spec] : options.inputs) specs.push_back(spec);
  auto inputs = lines.inputs(specs);
  if (!inputs) return pass_on(inputs, "panel");
  panel->lines_ = std::move(*inputs);
  const auto levels = panel->lines_->wait_change({}, Deadline{clock.now()});
  if (!levels) return pass_on(levels, "panel");
  panel->levels_ = *levels;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto field = options.inputs[i].first;
    const bool level = (*levels)[i];
    panel->inputs_.push_back({field, level, level, level && field == &PanelInputs::start, clock.now()});
  }
  return panel;
}

void GpioPanel::take(const std::vector<bool>& levels) {
  const auto now = clock_.now();
  levels_ = levels;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    Input& input = inputs_[i];
    if (levels[i] != input.level) {
      input.level = levels[i];
      input.since = now;
    }
    if (now - input.since >= kDebounce || (is_safety(input.field) && !input.level)) input.settled = input.level;
    if (!input.settled) input.held_since_open = false;
  }
}

PanelInputs GpioPanel::settled() const {
  PanelInputs now;
  for (const Input& input : inputs_) now.*input.field = input.settled && !input.held_since_open;
  return now;
}

Result<PanelInputs> GpioPanel::wait_change(const PanelInputs& known, Deadline deadline) {
  for (;;) {
    if (settled() != known || deadline.expired(clock_)) return settled();
    Deadline look_again = deadline;
    for (const Input& input : inputs_) {
      if (input.level != input.settled) look_again.at = std::min(look_again.at, input.since + kDebounce);
    }
    const auto levels = lines_->wait_change(levels_, look_again);
    if (!levels) return pass_on(levels, "panel");
    take(*levels);
  }
}

Result<void> GpioPanel::show(const PanelOutputs& outputs, Deadline) {
  for (const Lamp& lamp : lamps_) {
    if (auto set = lamp.line->set(outputs.*lamp.field); !set) return pass_on(set, "panel");
  }
  return {};
}

}  // namespace scanrig
