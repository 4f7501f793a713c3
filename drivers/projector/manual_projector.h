#pragma once

#include "drivers/projector/projector.h"

namespace scanrig {

/// A projector without a wire to this machine: its light is always on, or the operator switches it. Every exposure
/// succeeds with the present light. The driver cannot detect whether it is off, so the station prompts the operator.
class ManualProjector final : public Projector {
 public:
  Result<void> fire(Light, Deadline) override { return {}; }
  Result<void> turn_off(Deadline) override { return {}; }
  void request_off() noexcept override {}
};

}  // namespace scanrig
