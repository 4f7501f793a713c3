#pragma once

#include "core/clock.h"
#include "core/result.h"

namespace scanrig {

/// Debounced inputs; true has the meaning of the name.
struct PanelInputs {
  bool start = false;
  bool stop = false;
  bool reset = false;
  bool estop_ok = true;
  bool guard_closed = true;
  bool part_present = true;
  bool flipped = false;  ///< a signal other than the operator's reports that the object was turned over
  bool operator==(const PanelInputs&) const = default;
};

struct PanelOutputs {
  bool red = false;
  bool amber = false;
  bool green = false;
  bool start_lamp = false;    ///< Start has an effect now
  bool flip_request = false;  ///< turn the object over, then press Start
  bool busy = false;
  bool pass = false;
  bool fail = false;
  bool operator==(const PanelOutputs&) const = default;
};

/// Buttons and lamps beside the rig.
/// Threads: one owner.
class Panel {
 public:
  virtual ~Panel() = default;

  /// Waits until the inputs differ from `known` or the deadline passes; returns the inputs either way.
  /// Fails with `timeout`, `protocol`, `io` (the inputs are unknown: a caller that moves the table stops it),
  /// `device_alarm` (a button is pressed since the panel was opened).
  virtual Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) = 0;

  /// Fails with `timeout`, `protocol`, `io`.
  virtual Result<void> show(const PanelOutputs& outputs, Deadline deadline) = 0;
};

}  // namespace scanrig
