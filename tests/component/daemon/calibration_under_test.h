#pragma once

#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {

/// A daemon whose cameras see a small chessboard, and whose calibrations are solved by the test.
class CalibratedRig : public Daemon {
 protected:
  using What = event::JobRequested::What;

  void SetUp() override {
    Daemon::SetUp();
    options.calibrator.board = {.columns = 7, .rows = 5, .square_mm = 10.0, .markers = std::nullopt};
    options.calibrator.cameras = {"40012345", "40012346"};
    options.calibrator.solver = [this](CalibrationViews views, const Context&) {
      const std::lock_guard guard(mutex_);
      views_ = std::move(views);
      return answer_;
    };
    answer_.grade = "A";
    answer_.sentences = {"Volume 3 um."};
    answer_.file = new_calibration();
    rig.line.picture = board_at(0);
  }
  static std::string new_calibration() {
    return scan_samples::replaced(scan_samples::calibration_json(), "2026-11-21", "2026-11-25");
  }
  /// A board that is `shift` pixels off its place.
  static cv::Mat board_at(int shift) {
    constexpr int kSquare = 32;
    cv::Mat image(240, 320, CV_8UC1, cv::Scalar(190));
    for (int row = 0; row < 5; ++row) {
      for (int column = 0; column < 7; ++column) {
        if ((row + column) % 2 != 0) continue;
        const cv::Rect square(48 + shift + column * kSquare, 40 + row * kSquare, kSquare, kSquare);
        image(square).setTo(35);
      }
    }
    cv::GaussianBlur(image, image, {}, 0.7);
    return image;
  }
  void show(cv::Mat picture) {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.picture = std::move(picture);
  }
  std::string begin(RecipeKind kind = RecipeKind::calibration) {
    auto id = ask(JobOrder{.kind = kind});
    EXPECT_TRUE(id) << id.error().message;
    EXPECT_TRUE(clock_waits_for([this] { return loop->snapshot()->awaited_placement.has_value(); }));
    return id.value_or("");
  }
  /// `placement` counts from 0.
  bool wait_for_placement(int placement) {
    return clock_waits_for([&] {
      const auto snapshot = loop->snapshot();
      const auto& awaited = snapshot->awaited_placement;
      return snapshot->activity == Activity::waiting_for_flip && awaited && awaited->placement == placement;
    });
  }
  void take_placements(int first, int last) {
    for (int placement = first; placement <= last; ++placement) {
      rig.panel.press(&PanelInputs::start);
      if (placement < 6) {
        ASSERT_TRUE(wait_for_placement(placement + 1)) << placement;
      }
    }
  }
  std::string rig_file() const { return read_file(options.jobs.calibration_file).value_or(""); }

  std::mutex mutex_;
  CalibrationViews views_;
  CalibrationResult answer_;
};

}  // namespace scanrig
