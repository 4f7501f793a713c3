#pragma once

#include <memory>

#include "drivers/turntable/axis_turntable.h"
#include "drivers/turntable/modbus_drive.h"

namespace scanrig {

struct ModbusTurntableOptions : AxisTurntableOptions {
  modbus::ClientOptions line;
  DriveProfile profile;
};

/// A turntable moved by a Modbus motor drive.
class ModbusTurntable final : public AxisTurntable {
 public:
  /// Checks the options; the port is opened by the first use. Fails with `out_of_range`.
  static Result<std::unique_ptr<ModbusTurntable>> create(ModbusTurntableOptions options, Clock& clock);

  [[nodiscard]] const modbus::ClientStatistics& statistics() const { return line_; }

 private:
  class Drive;
  ModbusTurntable(const ModbusTurntableOptions& options, std::unique_ptr<Drive> drive,
                  const modbus::ClientStatistics& line, Clock& clock);

  const modbus::ClientStatistics& line_;
};

}  // namespace scanrig
