#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/gpio/lines.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Which line is which input or output; what is not wired keeps its rest value.
struct GpioPanelOptions {
  std::vector<std::pair<bool PanelInputs::*, gpio::LineSpec>> inputs;
  std::vector<std::pair<bool PanelOutputs::*, gpio::LineSpec>> outputs;
};

/// Buttons, switches and lamps on GPIO lines. A level counts once it has held for 50 ms; e-stop and guard count at once
/// when they open. A start button pressed when the panel is opened counts only after it has been released.
class GpioPanel final : public Panel {
 public:
  static constexpr std::chrono::milliseconds kDebounce{50};

  /// All lamps off. Fails with `not_found`, `io`.
  static Result<std::unique_ptr<GpioPanel>> open(const GpioPanelOptions& options, gpio::Lines& lines, Clock& clock);

  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override;
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override;

 private:
  struct Input {
    bool PanelInputs::*field;
    bool level = false;    // as it is
    bool settled = false;  // as it counts
    bool held_since_open = false;
    Clock::TimePoint since;
  };
  struct Lamp {
    bool PanelOutputs::*field;
    std::unique_ptr<gpio::Output> line;
  };

  explicit GpioPanel(Clock& clock) : clock_(clock) {}
  void take(const std::vector<bool>& levels);
  [[nodiscard]] PanelInputs settled() const;

  Clock& clock_;
  std::unique_ptr<gpio::Inputs> lines_;
  std::vector<bool> levels_;
  std::vector<Input> inputs_;
  std::vector<Lamp> lamps_;
};

}  // namespace scanrig
