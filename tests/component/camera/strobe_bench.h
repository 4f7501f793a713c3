#pragma once

#include <mutex>
#include <sstream>
#include <thread>

#include "drivers/projector/camera_strobe_projector.h"
#include "tests/component/camera/aravis_bench.h"

namespace scanrig {

/// Two GigE cameras of which the left fires a projector and the right: Line1 the pattern, Line2 plain light.
class StrobeBench : public AravisBench {
 public:
  static constexpr std::chrono::milliseconds kExposure{20};

  explicit StrobeBench(
      const Change& change = [](auto&) {}, const std::string& outputs = "full")
      : AravisBench(
            [&](AravisOptions& options) {
              options.strobe_outputs = {"Line1", "Line2"};
              options.exposure = kExposure;
              change(options);
            },
            400, "FrameStart", outputs) {
    // On a busy machine the simulated camera needs much longer than a real one to expose.
    if (opened()) {
      projector_ = std::make_unique<CameraStrobeProjector>(
          CameraStrobeProjectorOptions{"Line1", "Line2", kExposure, std::chrono::milliseconds(100)},
          *(*opened())->strobe(), clock());
    }
  }

  Projector& projector() { return *projector_; }
  Result<void> fire(Light light, Clock::Duration limit = std::chrono::seconds(5)) {
    return projector_->fire(light, Deadline::after(clock(), limit));
  }
  std::uint64_t fire() override {
    const auto fired = fire(Light::pattern);
    EXPECT_TRUE(fired) << fired.error().message;
    return ++fired_;
  }
  std::string tell(const std::string& words) {
    const std::scoped_lock lock(mutex_);
    return far().tell(words);
  }
  /// The nth flash, from 0; nothing if there were not so many.
  std::optional<std::pair<Light, Clock::TimePoint>> flash(std::size_t index) {
    std::istringstream words(tell("flash " + std::to_string(index)));
    std::string light;
    std::int64_t at = 0;
    if (!(words >> light >> at)) return std::nullopt;
    return std::pair(light == "pattern" ? Light::pattern : Light::plain,
                     Clock::TimePoint(std::chrono::nanoseconds(at)));
  }
  std::size_t flashes() {
    std::size_t count = 0;
    while (flash(count)) ++count;
    return count;
  }
  bool is_lit() { return tell("lit") == "1"; }

 private:
  std::mutex mutex_;
  std::unique_ptr<CameraStrobeProjector> projector_;
  std::uint64_t fired_ = 0;
};

}  // namespace scanrig
