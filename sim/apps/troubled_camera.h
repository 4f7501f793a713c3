#pragma once

#include <cstdint>

#include "sim/devices/sim_rig.h"

namespace scanrig::sim {

/// The rig's camera with faults. Before a `share` of its exposures one fault occurs: one pair of frames is lost, all
/// further frames are lost, the table is blocked, the guard is opened, or the e-stop is pressed. Kind and time follow
/// from `seed`. Each fault except the first stays until an operator fixes it.
class TroubledCamera final : public StereoCamera {
 public:
  TroubledCamera(SimRig& rig, double share, std::uint64_t seed) : rig_(rig), share_(share), seed_(seed) {}
  Result<void> prepare(Deadline deadline) override { return rig_.camera().prepare(deadline); }
  Result<void> scale_exposure(double factor, Deadline deadline) override {
    return rig_.camera().scale_exposure(factor, deadline);
  }
  Result<void> arm(Deadline deadline) override;
  Result<StereoFrame> collect(Deadline deadline) override { return rig_.camera().collect(deadline); }
  Result<StereoFrame> capture_preview(Deadline deadline) override { return rig_.camera().capture_preview(deadline); }

 private:
  SimRig& rig_;
  double share_;
  std::uint64_t seed_;
  std::uint64_t exposures_ = 0;
};

}  // namespace scanrig::sim
