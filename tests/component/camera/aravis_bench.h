#pragma once

#include <gtest/gtest.h>

#include "drivers/camera/aravis_stereo_camera.h"
#include "drivers/gpio/lines.h"
#include "sim/wire/gige_camera.h"
#include "tests/component/camera/far_cameras.h"
#include "tests/component/camera/stereo_camera_bench.h"

namespace scanrig {

/// The shipped driver against two GigE cameras in a process of their own; edges through the GPIO socket.
class AravisBench : public StereoCameraBench {
 public:
  using Change = std::function<void(AravisOptions&)>;

  explicit AravisBench(
      const Change& change = [](auto&) {}, int late_ms = 400, const std::string& selector = "FrameStart",
      const std::string& outputs = "full", const std::vector<std::string>& properties = {},
      Clock::Duration limit = std::chrono::seconds(10)) {
    std::vector<std::string> words{
        socket_, std::to_string(size_.width), std::to_string(size_.height), std::to_string(late_ms), selector, outputs};
    words.insert(words.end(), properties.begin(), properties.end());
    far_ = std::make_unique<FarCameras>(SCANRIG_GIGE_CAMERA, words);
    EXPECT_EQ(far_->hear(), "ready");
    options_.left = {"40012345", "127.0.0.1"};
    options_.right = {"40012346", "127.0.0.2"};
    options_.exposure = std::chrono::microseconds(2000);
    options_.packet_bytes = 1500;
    options_.frame_timeout = std::chrono::milliseconds(200);
    change(options_);
    lines_ = gpio::socket_lines(socket_, clock_);
    auto line = lines_->output({"DOTS", false});
    EXPECT_TRUE(line) << line.error().message;
    line_ = std::move(*line);
    open(limit);
  }

  /// Connects, and returns how long it took.
  Clock::Duration open(Clock::Duration limit = std::chrono::seconds(10)) {
    opened_ = fail(ErrorCode::io, "not open");  // the camera's control is given back
    const auto begun = clock_.now();
    opened_ = open_aravis(options_, clock_, Deadline::after(clock_, limit));
    return clock_.now() - begun;
  }

  [[nodiscard]] const Result<std::unique_ptr<SensorCamera>>& opened() const { return opened_; }
  SensorCamera& camera() override { return **opened_; }
  Clock& clock() override { return clock_; }
  FarCameras& far() { return *far_; }

  std::uint64_t fire() override {
    EXPECT_TRUE(line_->set(true));
    EXPECT_TRUE(line_->set(false));
    return ++fired_;
  }
  std::optional<std::uint64_t> number_in(const cv::Mat& image) override { return sim::wire::hidden_number(image); }
  bool spoil(Fault fault) override {
    constexpr std::array kWords{"lost", "late", "torn", "stale"};
    return far_->tell(std::string("fault right ") + kWords[static_cast<std::size_t>(fault)] + " 1") == "ok";
  }
  bool plug(bool in) override { return far_->tell(in ? "plug right 1" : "plug right 0") == "ok"; }
  cv::Size size() const override { return size_; }

 private:
  RealClock clock_;
  const cv::Size size_{160, 120};
  const std::string socket_ = testing::TempDir() + "gige" + std::to_string(::getpid()) + "-" +
                              std::to_string(reinterpret_cast<std::uintptr_t>(this));
  std::unique_ptr<FarCameras> far_;
  AravisOptions options_;
  std::unique_ptr<gpio::Lines> lines_;
  std::unique_ptr<gpio::Output> line_;
  Result<std::unique_ptr<SensorCamera>> opened_;
  std::uint64_t fired_ = 0;
};

}  // namespace scanrig
