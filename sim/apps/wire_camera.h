#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "core/clock.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"
#include "sim/apps/truth_socket.h"
#include "sim/scene/scene.h"
#include "sim/scene/truth_writer.h"

namespace scanrig::sim {

/// Cameras over a rendered scene for a rig whose other devices are real drivers on simulated wires. Each exposure shows
/// the object at the table's true angle and in the true light, as read from the far end of the wire.
/// Threads: the owner of the camera; turned_over() and write_truth() from any.
class WireCamera final : public StereoCamera {
 public:
  WireCamera(std::unique_ptr<Scene> scene, std::filesystem::path truth, Clock& clock)
      : scene_(std::move(scene)), truth_(std::move(truth)), clock_(clock) {}

  Result<void> prepare(Deadline deadline) override;
  Result<void> arm(Deadline deadline) override;
  Result<void> scale_exposure(double factor, Deadline) override {
    factor_ = factor;
    return {};
  }
  Result<StereoFrame> collect(Deadline deadline) override;
  /// Exposed under the plain light.
  Result<StereoFrame> capture_preview(Deadline deadline) override;

  /// The trigger line: an exposure starts, and lasts as long as `fire` does.
  Result<void> expose(Light light, const std::function<Result<void>()>& fire);
  void turned_over();

  /// truth.json and truth.ply of the last poses taken, into a scan folder. Fails with `degenerate`, `io`.
  Result<void> write_truth(const std::filesystem::path& folder) const;

 private:
  struct Exposure {
    int placement = 0;
    double angle_deg = 0.0;
    bool pattern = false;
    Clock::TimePoint taken{};
  };

  const std::unique_ptr<Scene> scene_;
  TruthSocket truth_;
  Clock& clock_;
  std::uint64_t exposures_ = 0, previews_ = 0;
  bool armed_ = false;
  double factor_ = 1.0;  // of the configured exposure
  std::optional<Result<Exposure>> exposed_;

  mutable std::mutex mutex_;
  ExposureHistory history_;  // guarded by mutex_
};

/// In front of the real projector: replaces the trigger line of a bench.
class WatchedProjector final : public Projector {
 public:
  WatchedProjector(Projector& projector, WireCamera& camera) : projector_(projector), camera_(camera) {}
  Result<void> fire(Light light, Deadline deadline) override {
    return camera_.expose(light, [&] { return projector_.fire(light, deadline); });
  }
  Result<void> turn_off(Deadline deadline) override { return projector_.turn_off(deadline); }
  void request_off() noexcept override { projector_.request_off(); }

 private:
  Projector& projector_;
  WireCamera& camera_;
};

/// In front of the real panel: Start pressed while the flip lamp is on means that the object was turned over.
class WatchedPanel final : public Panel {
 public:
  WatchedPanel(Panel& panel, WireCamera& camera) : panel_(panel), camera_(camera) {}
  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override {
    return panel_.wait_change(known, deadline);
  }
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override;

 private:
  Panel& panel_;
  WireCamera& camera_;
  bool flip_requested_ = false;
};

}  // namespace scanrig::sim
