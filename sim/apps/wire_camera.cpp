#include "sim/apps/wire_camera.h"

#include <future>

#include "core/units.h"

namespace scanrig::sim {

Result<void> WireCamera::prepare(Deadline) {
  if (const auto there = truth_.get(); !there) return pass_on(there);
  return {};
}

Result<void> WireCamera::arm(Deadline deadline) {
  if (auto there = prepare(deadline); !there) return there;
  exposed_.reset();
  armed_ = true;
  return {};
}

Result<void> WireCamera::expose(Light light, const std::function<Result<void>()>& fire) {
  auto firing = std::async(std::launch::async, fire);
  Result<TableTruth> middle = truth_.get();
  bool lit = middle && middle->projector_on;
  // Polled as long as the light may be on: it is on for a few milliseconds only.
  while (middle && firing.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    const auto now = truth_.get();
    if (!now) {
      middle = now;
    } else if (now->projector_on) {
      middle = now;
      lit = true;
    }
  }
  auto fired = firing.get();
  if (!fired || !armed_) return fired;
  armed_ = false;
  if (!middle) {
    exposed_ = pass_on(middle);
    return fired;
  }
  const std::scoped_lock lock(mutex_);
  history_.exposed(middle->angle_deg);
  exposed_ = Exposure{history_.placement(), middle->angle_deg, light == Light::pattern && lit, clock_.now()};
  return fired;
}

Result<StereoFrame> WireCamera::collect(Deadline deadline) {
  armed_ = false;
  if (!exposed_) {
    clock_.sleep_until(deadline.at);
    return fail(ErrorCode::timeout, "simulated camera: no trigger edge");
  }
  const auto e = *std::exchange(exposed_, std::nullopt);
  if (!e) return pass_on(e);
  const auto images = scene_->shoot(e->placement, to_radians(e->angle_deg), e->pattern, ++exposures_, 0.0, factor_);
  return StereoFrame{images.left, images.right, PixelFormat::bayer_rggb8, 1, e->taken};
}

Result<StereoFrame> WireCamera::capture_preview(Deadline) {
  armed_ = false;
  exposed_.reset();
  const auto table = truth_.get();
  if (!table) return pass_on(table);
  std::unique_lock lock(mutex_);
  const int placement = history_.placement();
  lock.unlock();
  const auto images = scene_->shoot(placement, to_radians(table->angle_deg), false, Scene::kFirstPreview + previews_++);
  return StereoFrame{images.left, images.right, PixelFormat::bayer_rggb8, 1, clock_.now()};
}

void WireCamera::turned_over() {
  const std::scoped_lock lock(mutex_);
  history_.turned_over(*scene_);
}

Result<void> WireCamera::write_truth(const std::filesystem::path& folder) const {
  std::vector<PoseTruth> taken;
  {
    const std::scoped_lock lock(mutex_);
    taken = history_.latest(*scene_);
  }
  return sim::write_truth(*scene_, taken, folder);
}

Result<void> WatchedPanel::show(const PanelOutputs& outputs, Deadline deadline) {
  if (flip_requested_ && !outputs.flip_request) camera_.turned_over();
  flip_requested_ = outputs.flip_request;
  return panel_.show(outputs, deadline);
}

}  // namespace scanrig::sim
