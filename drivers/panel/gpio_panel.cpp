#include "drivers/panel/gpio_panel.h"

#include <algorithm>

namespace scanrig {

Result<std::unique_ptr<GpioPanel>> GpioPanel::open(const GpioPanelOptions& options, gpio::Lines& lines, Clock& clock) {
  std::vector<bool PanelInputs::*> fields;
  std::vector<gpio::LineSpec> specs;
  for (const auto& [field, spec] : options.inputs) {
    fields.push_back(field);
    specs.push_back(spec);
  }
  std::unique_ptr<GpioPanel> panel(new GpioPanel(fields, clock));
  for (auto [field, spec] : options.outputs) {
    spec.keep = true;  // the lamps keep their state when the daemon ends
    auto line = lines.output(spec);
    if (!line) return pass_on(line, "panel");
    panel->lamps_.push_back({field, std::move(*line)});
  }
  auto inputs = lines.inputs(specs);
  if (!inputs) return pass_on(inputs, "panel");
  panel->lines_ = std::move(*inputs);
  const auto levels = panel->lines_->wait_change({}, Deadline{clock.now()});
  if (!levels) return pass_on(levels, "panel");
  panel->levels_ = *levels;
  panel->debounce_.take(*levels, clock.now());
  return panel;
}

Result<PanelInputs> GpioPanel::wait_change(const PanelInputs& known, Deadline deadline) {
  for (;;) {
    const PanelInputs now = debounce_.settled();
    if (now != known || deadline.expired(clock_)) {
      const auto free = debounce_.none_stuck();
      if (free) return now;
      // Without this a released button would stay stuck. A failure here occurs again at the next call.
      std::ignore = look(Deadline::after(clock_, PanelDebounce::kDebounce));
      return pass_on(free);
    }
    const auto due = debounce_.due();
    if (auto looked = look({std::min(deadline.at, due.value_or(deadline.at))}); !looked) return pass_on(looked);
  }
}

Result<void> GpioPanel::look(Deadline deadline) {
  const auto levels = lines_->wait_change(levels_, deadline);
  if (!levels) return pass_on(levels, "panel");
  levels_ = *levels;
  debounce_.take(*levels, clock_.now());
  return {};
}

Result<void> GpioPanel::show(const PanelOutputs& outputs, Deadline) {
  for (const Lamp& lamp : lamps_) {
    if (auto set = lamp.line->set(outputs.*lamp.field); !set) return pass_on(set, "panel");
  }
  return {};
}

}  // namespace scanrig
