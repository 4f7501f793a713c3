#include "sim/apps/rig_cameras.h"

#include "sim/apps/wire_rig.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

constexpr std::chrono::milliseconds kReadout{25};  // as the cameras of sim/devices
constexpr std::size_t kKeptImages = 8;

Clock::Duration exposure_time() {
  return std::chrono::round<Clock::Duration>(std::chrono::duration<double>(profile().exposure_s));
}

constexpr int kNumberBits = 32;

void number_faintly(std::uint32_t number, cv::Mat& frame) {
  auto* pixel = frame.ptr<std::uint8_t>(0);
  for (int bit = 0; bit < kNumberBits; ++bit) {
    pixel[bit] = static_cast<std::uint8_t>((pixel[bit] & ~1U) | (number >> bit & 1U));
  }
}

}  // namespace

std::uint32_t faint_number(const cv::Mat& frame) {
  std::uint32_t number = 0;
  for (int bit = 0; bit < kNumberBits; ++bit) number |= (frame.ptr<std::uint8_t>(0)[bit] & 1U) << bit;
  return number;
}

Result<std::unique_ptr<RigCameras>> RigCameras::start(const RigCamerasOptions& options, std::function<RigTruth()> truth,
                                                      Clock& clock) {
  auto scene = Scene::create(options.scene);
  if (!scene) return pass_on(scene);
  std::unique_ptr<RigCameras> rig(new RigCameras(std::move(*scene), options, std::move(truth), clock));
  const Eye &left = rig->scene_->rig().left, &right = rig->scene_->rig().right;
  wire::GigeCamerasOptions cameras;
  cameras.left_address = kLeftAddress;
  cameras.right_address = kRightAddress;
  cameras.left_serial = left.serial;
  cameras.right_serial = right.serial;
  cameras.size = {left.width, left.height};
  cameras.frame_after = std::chrono::round<std::chrono::microseconds>(exposure_time() + kReadout);
  cameras.late_by = std::chrono::milliseconds(1000);
  cameras.numbered = false;
  cameras.is_strobe_wired = false;
  cameras.nominal_exposure = std::chrono::round<std::chrono::microseconds>(exposure_time());
  cameras.model.state = options.state;
  cameras.model.has_user_sets = !options.state || *options.state % 2 == 0;
  cameras.model.max_exposure_us = options.max_exposure_us;
  cameras.ready = [&rig = *rig](const wire::GigeExposure& exposure) { return rig.ready(exposure); };
  const auto source = [&rig = *rig](wire::Side side, const wire::GigeExposure& exposure, cv::Mat& image) {
    rig.read_out(side, exposure, image);
  };
  auto started = wire::GigeCameras::start(cameras, source, clock);
  if (!started) return pass_on(started);
  rig->wire_ = std::move(*started);
  rig->developer_ = std::jthread([&rig = *rig](const std::stop_token& stop) { rig.develop(stop); });
  return rig;
}

RigCameras::RigCameras(std::unique_ptr<Scene> scene, const RigCamerasOptions& options, std::function<RigTruth()> truth,
                       Clock& clock)
    : truth_(std::move(truth)),
      clock_(clock),
      numbered_(options.numbered),
      scene_(std::move(scene)),
      views_(*scene_, options.expected) {}

RigCameras::~RigCameras() {
  developer_.request_stop();
  views_.end();
  if (developer_.joinable()) developer_.join();
}

void RigCameras::edge(bool pattern) {
  const auto at = clock_.now();
  const auto number = wire_->edge(pattern);  // its threads call ready(): not with mutex_ held
  const std::scoped_lock lock(mutex_);
  exposures_.push_back({.number = number, .pattern = pattern, .at = at, .ended = at + exposure_time()});
  exposed_.notify_all();
}

void RigCameras::light_out() {
  const std::scoped_lock lock(mutex_);
  if (!exposures_.empty() && clock_.now() < exposures_.back().ended) exposures_.back().lit = false;
}

void RigCameras::turned_over() {
  const std::scoped_lock lock(mutex_);
  history_.turned_over(*scene_);
}

/// Handles one exposure after the other: notes its view while it lasts, then turns it into two images.
void RigCameras::develop(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (exposed_.wait(lock, stop, [&] { return developed_ < exposures_.size(); })) {
    const RigExposure started = exposures_[developed_];
    lock.unlock();
    clock_.sleep_until(started.at + exposure_time() / 2);
    const double angle_deg = truth_().angle_deg;
    clock_.sleep_until(started.ended);
    lock.lock();
    RigExposure& exposure = exposures_[developed_];
    exposure.place = {history_.placement(), angle_deg};
    history_.exposed(angle_deg);
    const RigExposure ended = exposure;
    lock.unlock();
    StereoImages images = image(ended);
    lock.lock();
    ++developed_;
    images_[ended.number] = std::move(images);
    if (images_.size() > kKeptImages) images_.erase(images_.begin());
  }
}

void RigCameras::set_lights(const RigLights& lights) {
  const std::scoped_lock lock(mutex_);
  lights_ = lights;
  lights_set_ = clock_.now();
}

StereoImages RigCameras::image(const RigExposure& exposure) {
  if (!exposure.lit) return {};
  const auto view = views_.get(exposure.place);
  return view ? expose(*view, exposure) : StereoImages{};
}

StereoImages RigCameras::expose(const View& view, const RigExposure& exposure) const {
  std::unique_lock lock(mutex_);
  const RigLights lights = lights_;
  const std::chrono::duration<double> since = exposure.at - lights_set_;
  lock.unlock();
  if (lights == RigLights()) return scene_->expose(view, exposure.pattern, exposure.number);
  const double strength = 1.0 + lights.change_per_s * since.count();
  LightLevels levels{.plain = lights.room, .is_slide_in = lights.is_slide_in};
  if (exposure.pattern) {
    levels.pattern = strength * lights.pattern;
  } else {
    levels.plain += strength * lights.plain;
  }
  return scene_->expose(view, levels, exposure.number);
}

/// An exposure without an edge: in the room's light alone.
StereoImages RigCameras::image_by_software(std::uint64_t number) {
  std::unique_lock lock(mutex_);
  const double room = lights_.room;
  const int placement = history_.placement();
  lock.unlock();
  if (room <= 0.0) return {};
  const auto view = views_.get({placement, truth_().angle_deg});
  return view ? scene_->expose(*view, {.plain = room}, number) : StereoImages{};
}

bool RigCameras::ready(const wire::GigeExposure& exposure) const {
  const std::scoped_lock lock(mutex_);
  return exposure.number <= developed_;
}

void RigCameras::read_out(wire::Side side, const wire::GigeExposure& exposure, cv::Mat& image) {
  const bool by_software = exposure.number >= wire::kFirstBySoftware;
  const StereoImages without_edge = by_software ? image_by_software(exposure.number) : StereoImages{};
  const std::scoped_lock lock(mutex_);
  const auto found = images_.find(exposure.number);
  const StereoImages& pair = found == images_.end() ? without_edge : found->second;
  const cv::Mat rendered = side == wire::Side::left ? pair.left : pair.right;
  if (rendered.empty()) {
    image.setTo(0);
  } else {
    rendered.copyTo(image);
  }
  if (numbered_) number_faintly(static_cast<std::uint32_t>(exposure.number), image);
  if (exposure.number <= exposures_.size()) exposures_[exposure.number - 1].read = clock_.now();
}

std::vector<RigExposure> RigCameras::exposures() const {
  const std::scoped_lock lock(mutex_);
  return {exposures_.begin(), exposures_.begin() + static_cast<std::ptrdiff_t>(developed_)};
}

Result<void> RigCameras::write_calibration(const std::filesystem::path& file) const {
  return sim::write_calibration(*scene_, file);
}

Result<void> RigCameras::write_truth(const std::filesystem::path& folder) const {
  std::vector<PoseTruth> taken;
  {
    const std::scoped_lock lock(mutex_);
    taken = history_.latest(*scene_);
  }
  return sim::write_truth(*scene_, taken, folder);
}

}  // namespace scanrig::sim
