#include "daemon/station/snapshot.h"

namespace scanrig {

Standstill standstill(const Snapshot& snapshot) {
  if (snapshot.may_be_moving || snapshot.machine == MachineState::preoperational) return Standstill::unknown;
  switch (snapshot.activity) {
    case Activity::stopping: return Standstill::pending;
    case Activity::homing:
    case Activity::jogging:
    case Activity::scanning: return Standstill::moving;
    default: return Standstill::confirmed;
  }
}

std::string_view to_string(Standstill standstill) {
  switch (standstill) {
    case Standstill::confirmed: return "confirmed";
    case Standstill::pending: return "pending";
    case Standstill::moving: return "moving";
    case Standstill::unknown: break;
  }
  return "unknown";
}

}  // namespace scanrig
