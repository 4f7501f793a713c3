#pragma once

#include "drivers/projector/projector.h"

namespace scanrig {

/// A projector without a wire to us: its dots burn always, or a hand switches them. Every exposure succeeds, with
/// whatever light there is; that it is dark is never known, so the station tells the operator to switch it.
class ManualProjector final : public Projector {
 public:
  Result<void> fire(Light, Deadline) override { return {}; }
  Result<void> turn_off(Deadline) override { return {}; }
  void request_off() noexcept override {}
};

}  // namespace scanrig
