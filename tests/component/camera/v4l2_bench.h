#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "drivers/camera/v4l2_stereo_camera.h"
#include "sim/wire/gige_camera.h"
#include "tests/component/camera/scripted_video.h"
#include "tests/component/camera/stereo_camera_bench.h"

namespace scanrig {

/// The shipped driver over scripted devices: two, or one that delivers both images side by side.
class V4l2Bench : public StereoCameraBench {
 public:
  using Change = std::function<void(V4l2Options&, ScriptedVideo&)>;

  explicit V4l2Bench(
      bool side_by_side = false, const Change& change = [](auto&, auto&) {})
      : devices_(side_by_side ? std::vector<std::string>{"/dev/both"}
                              : std::vector<std::string>{"/dev/left", "/dev/right"}),
        last_(devices_.size()) {
    for (const auto& device : devices_) video_.add(device);
    options_.left.device = devices_.front();
    if (!side_by_side) options_.right = V4l2SensorOptions{"", devices_.back()};
    options_.external_trigger = true;
    options_.size = {side_by_side ? 2 * size_.width : size_.width, size_.height};
    options_.exposure = std::chrono::microseconds(2000);
    options_.frame_timeout = std::chrono::milliseconds(100);
    change(options_, video_);
    opened_ = open_v4l2(options_, video_, clock_, Deadline::after(clock_, std::chrono::seconds(1)));
  }

  [[nodiscard]] const Result<std::unique_ptr<SensorCamera>>& opened() const { return opened_; }
  SensorCamera& camera() override { return **opened_; }
  Clock& clock() override { return clock_; }
  ScriptedVideo& video() { return video_; }

  std::uint64_t fire() override {
    ++fired_;
    ++sequence_;
    const auto edge = clock_.now();
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      const bool retake_reasons = fault_ && i + 1 == devices_.size();
      const auto stamp = edge + (i == 0 ? std::exchange(left_stamp_off_, {}) : Clock::Duration{});
      ScriptedVideo::Frame frame{image(fired_), sequence_, stamp, edge + std::chrono::milliseconds(3)};
      if (retake_reasons && *fault_ == Fault::stale) {
        frame = last_[i];
        frame.sequence = sequence_;
      }
      last_[i] = frame;
      if (retake_reasons && *fault_ == Fault::lost) continue;
      if (retake_reasons && *fault_ == Fault::late) frame.due += std::chrono::milliseconds(180);
      if (retake_reasons && *fault_ == Fault::torn) frame.flags = V4L2_BUF_FLAG_ERROR;
      video_.deliver(devices_[i], frame);
    }
    fault_.reset();
    return fired_;
  }
  /// Delays the next left frame's stamp by this much.
  void put_left_stamp_off(Clock::Duration by) { left_stamp_off_ = by; }
  std::optional<std::uint64_t> number_in(const cv::Mat& image) override { return sim::wire::hidden_number(image); }
  bool spoil(Fault fault) override {
    fault_ = fault;
    return true;
  }
  bool plug(bool in) override {
    video_.plug(devices_.back(), in);
    return true;
  }
  cv::Size size() const override { return size_; }

 private:
  [[nodiscard]] std::vector<std::uint8_t> image(std::uint64_t number) const {
    cv::Mat whole(options_.size, CV_8UC1);
    for (int x = 0; x < whole.cols; x += size_.width) {
      cv::Mat half = whole.colRange(x, x + size_.width);
      half.setTo(90);
      sim::wire::hide_number(static_cast<std::uint32_t>(number), half);
    }
    return {whole.datastart, whole.dataend};
  }

  RealClock clock_;
  const cv::Size size_{64, 48};
  ScriptedVideo video_{clock_};
  const std::vector<std::string> devices_;
  std::vector<ScriptedVideo::Frame> last_;
  V4l2Options options_;
  Result<std::unique_ptr<SensorCamera>> opened_;
  std::optional<Fault> fault_;
  Clock::Duration left_stamp_off_{};
  std::uint64_t fired_ = 0;
  std::uint32_t sequence_ = 0xFFFFFFF0;  // the sequence number restarts soon
};

}  // namespace scanrig
