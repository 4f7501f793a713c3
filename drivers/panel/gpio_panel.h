#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "drivers/gpio/lines.h"
#include "drivers/panel/debounce.h"

namespace scanrig {

/// Lines of the inputs and outputs; unwired ones keep their rest value.
struct GpioPanelOptions {
  std::vector<std::pair<bool PanelInputs::*, gpio::LineSpec>> inputs{};
  std::vector<std::pair<bool PanelOutputs::*, gpio::LineSpec>> outputs{};
};

/// Buttons, switches and lamps on GPIO lines, debounced by PanelDebounce. When destroyed, the lamps keep their state.
class GpioPanel final : public Panel {
 public:
  /// Switches all lamps off. Fails with `not_found`, `io`.
  static Result<std::unique_ptr<GpioPanel>> open(const GpioPanelOptions& options, gpio::Lines& lines, Clock& clock);

  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override;
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override;

 private:
  struct Lamp {
    bool PanelOutputs::*field;
    std::unique_ptr<gpio::Output> line;
  };

  Result<void> look(Deadline deadline);
  GpioPanel(const std::vector<bool PanelInputs::*>& fields, Clock& clock) : clock_(clock), debounce_(fields) {}

  Clock& clock_;
  std::unique_ptr<gpio::Inputs> lines_;
  std::vector<bool> levels_;
  PanelDebounce debounce_;
  std::vector<Lamp> lamps_;
};

}  // namespace scanrig
