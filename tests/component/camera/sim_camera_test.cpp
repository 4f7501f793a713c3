#include "sim/devices/sim_rig.h"
#include "tests/component/camera/stereo_camera_compliance.h"

namespace scanrig {
namespace {

/// The in-process cameras; their frames hide no number. The rig is made once: its object takes seconds.
class SimBench final : public StereoCameraBench {
 public:
  SimBench() {
    if (rig_) return;
    sim::SimRigOptions options;
    options.image_scale = 0.125;
    auto rig = sim::SimRig::create(options, clock_);
    EXPECT_TRUE(rig) << rig.error().message;
    rig_ = std::move(*rig);
  }
  StereoCamera& camera() override { return rig_->camera(); }
  Clock& clock() override { return clock_; }
  std::uint64_t fire() override {
    EXPECT_TRUE(rig_->projector().fire(Light::pattern, Deadline::after(clock_, std::chrono::seconds(1))));
    return ++fired_;
  }
  std::optional<std::uint64_t> number_in(const cv::Mat&) override { return std::nullopt; }
  bool spoil(Fault fault) override {
    if (fault == Fault::lost) rig_->lose_frames(1);
    return fault == Fault::lost;
  }
  bool plug(bool) override { return false; }
  cv::Size size() const override { return {160, 120}; }
  Clock::Duration ample() const override { return std::chrono::milliseconds(500); }

 private:
  static inline RealClock clock_;
  static inline std::unique_ptr<sim::SimRig> rig_;
  std::uint64_t fired_ = 0;
};

std::unique_ptr<StereoCameraBench> make_bench() { return std::make_unique<SimBench>(); }

INSTANTIATE_TEST_SUITE_P(Simulated, StereoCameraCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
