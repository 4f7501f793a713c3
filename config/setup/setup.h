#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/rig_config.h"
#include "config/setup/dialogue.h"
#include "config/setup/setup_options.h"
#include "core/clock.h"
#include "drivers/camera/camera_list.h"
#include "drivers/discovery/serial_devices.h"

namespace scanrig::config::setup {

/// Makes a rig.toml of what is connected. Devices are only read, and named by the person where that does not tell them
/// apart; the outputs of an I/O module are switched after the person has agreed. Nothing moves.
/// Threads: one owner.
class Setup {
 public:
  Setup(const SetupOptions& options, const Dialogue& dialogue, Clock& clock)
      : options_(options), dialogue_(dialogue), clock_(clock) {}

  /// Finds everything and writes the file. Fails with `refused` (the replies ended), `not_found` (a device that a rig
  /// needs), `unsupported` (a camera without colour or trigger), as save(), and as the devices.
  Result<RigConfig> run();
  /// Writes the file as far as it is known, unless it would not be valid. Fails with `io`, `internal`.
  Result<void> save() const;
  void reverse_sign() { motion().scale.positive_ccw = !motion().scale.positive_ccw; }

 private:
  /// Begins with the file that is there, where it can be read.
  void read_present();
  Result<void> find_serial_devices();
  Result<void> find_turntable();
  Result<void> use_drive(const discovery::SerialDevice& device);
  Result<void> use_grbl(const discovery::SerialDevice& device);
  Result<void> choose_motion();
  Result<void> find_panel();
  Result<void> find_projector();
  Result<void> find_cameras();
  Result<void> use_cameras(const FoundCamera& left, const FoundCamera& right);
  void choose_rest();

  AxisTurntableOptions& motion() {
    if (rig_.turntable.driver == TurntableConfig::Driver::grbl) return rig_.turntable.grbl;
    return rig_.turntable.modbus;
  }

  const SetupOptions& options_;
  const Dialogue& dialogue_;
  Clock& clock_;
  RigConfig rig_;
  std::string present_{};  ///< text of the file that is there; empty: none that can be used
  std::map<std::string, DriveProfile> profiles_;
  std::vector<discovery::SerialDevice> controllers_;  ///< drives and GRBL
  std::vector<discovery::SerialDevice> modules_;
  std::map<std::string, Pin> lights_;  ///< what switches the projector: "pattern", "plain"
};

}  // namespace scanrig::config::setup
