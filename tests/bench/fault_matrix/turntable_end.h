#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "drivers/turntable/turntable.h"
#include "sim/wire/axis.h"
#include "tests/bench/fault_matrix/cells.h"

namespace scanrig::bench {

/// A turntable driver with the far end of its wire.
class TurntableEnd {
 public:
  virtual ~TurntableEnd() = default;
  virtual Turntable& table() = 0;
  [[nodiscard]] virtual sim::wire::AxisTruth truth() = 0;

  /// Starts the fault now, including faults of the drive itself (alarm, blocked shaft).
  virtual void begin(Fault fault) = 0;
  /// Ends the fault; an alarm stays if it can be reset.
  virtual void end(Fault fault) = 0;
  /// Turns the table by another controller, without the driver.
  virtual void send_round() = 0;
  virtual void raise_alarm(bool can_be_reset) = 0;
  virtual void power_cycle() = 0;
};

/// One shipped driver class on one wire.
struct TurntableKind {
  std::string driver;
  std::string device;
  std::function<std::unique_ptr<TurntableEnd>(Clock&)> make;
};
std::vector<TurntableKind> shipped_turntables(const std::filesystem::path& scratch,
                                              const std::filesystem::path& profiles);

constexpr double kSpeedDegS = 90;
constexpr double kAccelerationDegS2 = 900;
constexpr double kToleranceDeg = 0.05;
constexpr double kGear = 9;

}  // namespace scanrig::bench
