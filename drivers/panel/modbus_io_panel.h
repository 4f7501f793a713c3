#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/modbus/bus.h"
#include "drivers/panel/debounce.h"

namespace scanrig {

/// Discrete inputs and coils of the module by signal; unwired ones keep their rest value.
struct ModbusIoPanelOptions {
  struct Signal {
    std::uint16_t address = 0;
    bool active_low = false;
  };
  modbus::ClientOptions line;
  std::vector<std::pair<bool PanelInputs::*, Signal>> inputs{};    ///< at least one
  std::vector<std::pair<bool PanelOutputs::*, Signal>> outputs{};  ///< coils
  std::chrono::milliseconds poll{20};
};

/// Buttons, switches and lamps on a Modbus RTU I/O module, debounced by PanelDebounce. The inputs are read every
/// polling period, each time after the coils: so no reply can be taken for that of an earlier request. A module that
/// was switched off and on, its lamps dark, is noticed. A missed reading is repeated once.
class ModbusIoPanel final : public Panel {
 public:
  /// The port is opened by the first use.
  ModbusIoPanel(ModbusIoPanelOptions options, Clock& clock);

  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override;
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override;

  [[nodiscard]] modbus::ClientStatistics statistics() const { return bus_->statistics(); }

 private:
  struct Span {
    std::uint16_t first = 0;
    int count = 1;
  };

  template <class Wired>
  static Span span_of(const Wired& wired);
  Result<void> poll();
  using Turn = modbus::Bus::Turn;
  Result<void> read_once(const Turn& bus);
  Result<void> coils_as_shown(const Turn& bus, Deadline deadline);
  Result<void> write(const Turn& bus, const PanelOutputs& outputs, Deadline deadline);

  ModbusIoPanelOptions options_;
  Clock& clock_;
  const std::shared_ptr<modbus::Bus> bus_;  // the projector may be on the same module
  const Span inputs_;
  const Span coils_;
  std::optional<PanelDebounce> debounce_;  // nothing: the inputs are unknown
  std::optional<PanelOutputs> shown_;      // nothing: the coils are unknown
  Clock::TimePoint next_poll_;
};

}  // namespace scanrig
