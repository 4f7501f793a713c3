#include <cstdlib>
#include <thread>

#include "config/rig_config.h"
#include "daemon/rig/open_devices.h"
#include "tests/component/turntable/turntable_compliance.h"

// The turntable of a real rig: SCANRIG_RIG_TOML names its configuration, `ctest -L rig` runs this. The table turns:
// keep people away from it, and put nothing on it. The table is its own onlooker.

namespace scanrig {
namespace {

using std::chrono::milliseconds;

class RigBench final : public TurntableBench {
 public:
  explicit RigBench(const config::RigConfig& rig)
      : rig_(rig), table_(std::move(open_devices(rig_, clock_).value().turntable)) {}

  Turntable& turntable() override { return *table_; }
  Clock& clock() override { return clock_; }
  double seen_deg() override { return look().angle.value_or(Degrees{0}).value; }
  bool seen_moving() override { return look().motion != TurntableStatus::Motion::stopped; }
  bool can_block() override { return false; }
  void block(bool) override {}
  void when_moving(std::function<void()> act) override {
    // The device must not be read meanwhile: it is moving by then.
    onlooker_ = std::jthread([this, act = std::move(act)](const std::stop_token& stop) {
      clock_.sleep_for(milliseconds(700));
      if (!stop.stop_requested()) act();
    });
  }
  Clock::Duration ample() override { return std::chrono::minutes(2); }
  Clock::Duration too_short() override { return milliseconds(300); }
  Degrees tolerance() override { return rig_.turntable.motion().tolerance; }

 private:
  TurntableStatus look() {
    const auto status = table_->status(Deadline::after(clock_, std::chrono::seconds(5)));
    EXPECT_TRUE(status) << status.error().message;
    return status.value_or(TurntableStatus{});
  }

  RealClock clock_;
  const config::RigConfig rig_;
  std::unique_ptr<Turntable> table_;
  std::jthread onlooker_;
};

std::unique_ptr<TurntableBench> make_bench() {
  const char* file = std::getenv("SCANRIG_RIG_TOML");
  if (file == nullptr) return nullptr;
  const auto rig = config::read_rig_config(file, {}, config::Cameras::or_simulated);
  EXPECT_TRUE(rig) << rig.error().message;
  return rig ? std::make_unique<RigBench>(*rig) : nullptr;
}

INSTANTIATE_TEST_SUITE_P(Rig, TurntableCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
