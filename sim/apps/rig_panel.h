#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/gpio_socket.h"
#include "sim/wire/modbus_io.h"
#include "sim/wire/modbus_server.h"

namespace scanrig::sim {

/// The operator's side of the simulated rig: buttons, contacts, lamps and the projector's trigger line, behind the GPIO
/// socket; or, except the trigger, behind a Modbus I/O module, unit 2. A closed contact pulls its GPIO line low and
/// sets its input of the module.
/// Threads: every function may be called from any thread.
class RigPanel {
 public:
  /// State of a wire: as drawn, broken, or bridged.
  enum class Wiring { wired, broken, bridged };

  /// One change of an input by hand, or of an output line.
  struct Change {
    Clock::TimePoint at;
    std::string name;
    bool on = false;
  };

  /// FOLDER/gpio.sock and, with `on_module`, the port FOLDER/panel. Fails with `io`.
  static Result<std::unique_ptr<RigPanel>> start(const std::filesystem::path& folder, bool on_module, Clock& clock);

  /// "start", "stop", "reset", "estop" (pressed: its contact opens), "guard" (pressed: closed), "part", "flipped".
  /// Returns the time of the change. Fails with `not_found`.
  Result<Clock::TimePoint> press(const std::string& input, bool pressed);
  Result<void> rewire(const std::string& input, Wiring wiring);
  [[nodiscard]] std::map<std::string, bool> inputs() const;   ///< pressed
  [[nodiscard]] std::map<std::string, bool> outputs() const;  ///< by the keys of rig.toml: "lamp_red"
  [[nodiscard]] bool pressed(const std::string& input) const;
  [[nodiscard]] bool light() const;  ///< pattern or plain light
  /// Called when pattern or plain light is switched, from the line's thread; empty: no listener.
  void on_light(std::function<void(bool pattern, bool on)> listener);
  [[nodiscard]] std::vector<Change> changes() const;
  [[nodiscard]] wire::ModbusServer* module_port() { return server_.get(); }  ///< null on GPIO

 private:
  explicit RigPanel(Clock& clock) : clock_(clock) {}
  void apply(const std::string& input);

  struct Input {
    std::string line;
    std::size_t channel = 0;
    bool opens = false;  ///< a normally closed contact
    bool pressed = false;
    Wiring wiring = Wiring::wired;
  };

  Clock& clock_;
  mutable std::mutex mutex_;
  std::map<std::string, Input> inputs_;
  std::vector<Change> pressed_changes_;
  std::unique_ptr<wire::GpioSocket> gpio_;
  std::unique_ptr<wire::ModbusIoModule> module_;
  std::unique_ptr<wire::ModbusServer> server_;
};

}  // namespace scanrig::sim
