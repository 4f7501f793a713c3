#pragma once

#include <functional>
#include <optional>
#include <thread>

#include "core/parallel.h"
#include "core/priority.h"
#include "drivers/camera/stereo_camera.h"

namespace scanrig::sim {

/// A simulated camera that renders with low priority: a real one takes no time of the processor either, so a page on
/// the same machine is drawn as quickly as beside a real rig. Views are later, where other programs are busy.
class BackgroundCamera final : public StereoCamera {
 public:
  explicit BackgroundCamera(StereoCamera& camera) : camera_(camera) {}
  Result<void> prepare(Deadline deadline) override { return camera_.prepare(deadline); }
  Result<void> scale_exposure(double factor, Deadline deadline) override {
    return camera_.scale_exposure(factor, deadline);
  }
  Result<void> arm(Deadline deadline) override { return camera_.arm(deadline); }
  Result<StereoFrame> collect(Deadline deadline) override {
    return in_background([&] { return camera_.collect(deadline); });
  }
  Result<StereoFrame> capture_preview(Deadline deadline) override {
    return in_background([&] { return camera_.capture_preview(deadline); });
  }

 private:
  static Result<StereoFrame> in_background(const std::function<Result<StereoFrame>()>& render) {
    std::optional<Result<StereoFrame>> frame;
    std::jthread([&] {
      lower_priority();
      with_threads(0, [&] { frame = render(); });
    }).join();
    return *std::move(frame);
  }

  StereoCamera& camera_;
};

}  // namespace scanrig::sim
