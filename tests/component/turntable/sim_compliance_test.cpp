#include "sim/devices/sim_rig.h"
#include "tests/component/turntable/turntable_compliance.h"
#include "tests/unit/sim/devices/manual_clock.h"

// The in-process turntable, on a clock of its own. It is its own onlooker.

namespace scanrig {
namespace {

using std::chrono::milliseconds;

class SimBench final : public TurntableBench {
 public:
  SimBench() {
    // One rig for all tests, since making it takes long: each starts not homed and with the table stopped.
    rig().stall_turntable(false);
    turntable().request_stop();
    std::ignore = turntable().home(Deadline::after(clock(), std::chrono::minutes(2)));
    std::ignore = turntable().stop(Deadline::after(clock(), std::chrono::minutes(2)));
  }

  Turntable& turntable() override { return rig().turntable(); }
  Clock& clock() override { return manual(); }
  double seen_deg() override { return look().angle.value().value; }
  bool seen_moving() override { return look().motion == TurntableStatus::Motion::moving; }
  void block(bool blocked) override { rig().stall_turntable(blocked); }
  void when_moving(std::function<void()> act) override { manual().at(milliseconds(500), std::move(act)); }
  Clock::Duration ample() override { return std::chrono::minutes(2); }
  Clock::Duration too_short() override { return milliseconds(500); }
  Degrees tolerance() override { return {0.05}; }

 private:
  static sim::ManualClock& manual() {
    static sim::ManualClock clock;
    return clock;
  }
  static sim::SimRig& rig() {
    static const auto rig = [] {
      sim::SimRigOptions options;
      options.image_scale = 0.1;
      return sim::SimRig::create(options, manual()).value();
    }();
    return *rig;
  }
  TurntableStatus look() { return turntable().status(Deadline::after(clock(), milliseconds(1))).value(); }
};

std::unique_ptr<TurntableBench> make_bench() { return std::make_unique<SimBench>(); }

INSTANTIATE_TEST_SUITE_P(InProcess, TurntableCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
