#pragma once

#include "drivers/camera/stereo_camera.h"
#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"
#include "drivers/turntable/turntable.h"
#include "sim/devices/shared_state.h"

namespace scanrig::sim {

/// Fails as Turntable does, with these codes: `not_homed`, `out_of_range` (beyond ten turns), `timeout`, `stalled`,
/// `device_alarm` (the e-stop has cut the motor's power), `stopped`. A target out of range leaves the table homed.
class SimTurntable final : public Turntable {
 public:
  explicit SimTurntable(SharedState& state);
  Result<void> home(Deadline deadline) override;
  Result<Move> rotate_to(Degrees target, Deadline deadline) override;
  Result<void> stop(Deadline deadline) override;
  Result<void> reset_alarm(Deadline deadline) override;
  Result<TurntableStatus> status(Deadline deadline) override;
  Result<void> limit_speed(std::optional<DegreesPerSecond> limit) override;
  void request_stop() noexcept override;
  void drop_stop_request() noexcept override;

 private:
  Result<void> travel(std::unique_lock<std::mutex>& lock, double target, Deadline deadline, Move& move);
  Result<void> wait_for(std::unique_lock<std::mutex>& lock, Clock::TimePoint moment, Deadline deadline);

  SharedState& state_;
  bool homed_ = false;
  double speed_;  // deg/s
};

/// Fails with `timeout`, and with `io` if request_off() cut the pulse short.
class SimProjector final : public Projector {
 public:
  explicit SimProjector(SharedState& state) : state_(state) {}
  Result<void> fire(Light light, Deadline deadline) override;
  Result<void> turn_off(Deadline deadline) override;
  void request_off() noexcept override;

 private:
  SharedState& state_;
};

/// collect() fails with `timeout`, and with `protocol` if it was not armed. A preview is exposed under the plain light.
class SimStereoCamera final : public StereoCamera {
 public:
  explicit SimStereoCamera(SharedState& state) : state_(state) {}
  Result<void> prepare(Deadline) override { return {}; }
  Result<void> arm(Deadline deadline) override;
  Result<void> scale_exposure(double factor, Deadline deadline) override;
  Result<StereoFrame> collect(Deadline deadline) override;
  Result<StereoFrame> capture_preview(Deadline deadline) override;

 private:
  StereoFrame render(const Exposure& exposure);

  SharedState& state_;
  bool collectable_ = false;  // armed since the last collect()
  int board_ = 0;             // the board's placement at the last one
  std::uint64_t previews_ = 0;
};

class SimPanel final : public Panel {
 public:
  explicit SimPanel(SharedState& state) : state_(state) {}
  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override;
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override;

 private:
  SharedState& state_;
};

}  // namespace scanrig::sim
