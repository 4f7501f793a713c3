#include <gmock/gmock.h>
#include <sys/resource.h>

#include <atomic>
#include <random>
#include <thread>

#include "daemon/ctl/client.h"
#include "daemon/rig/make_safe.h"
#include "daemon/rig/open_devices.h"
#include "daemon/service/run_daemon.h"
#include "tests/component/daemon/fake_reconstructor.h"
#include "tests/component/daemon/fake_rig.h"
#include "tests/component/safety/wire_rig.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;

/// A light table, so that real time is short.
const sim::wire::AxisOptions kLight{.gear_ratio = 9, .start_deg = 60};
const WireRig::Changes kFast{{"speed_deg_s = 45", "speed_deg_s = 360"},
                             {"acceleration_deg_s2 = 90", "acceleration_deg_s2 = 3600"},
                             {"settle_ms = 200", "settle_ms = 60"}};

/// The daemon with the shipped drivers of turntable, projector and panel; only the cameras are fakes.
class DaemonOnWires : public testing::Test {
 protected:
  void SetUp() override {
    scan_samples::write_text(rig.folder / "calibration.json", scan_samples::calibration_json());
    auto read = config::read_rig_config(rig.config());
    ASSERT_TRUE(read) << read.error().message;
    config = std::make_unique<config::RigConfig>(std::move(*read));
    auto opened = open_devices(*config, rig.clock);
    ASSERT_TRUE(opened) << opened.error().message;
    open = std::make_unique<OpenDevices>(std::move(*opened));
    DaemonOptions options;
    options.jobs = {.root = config->storage.root, .calibration_file = config->calibration_file, .profile = {}};
    options.api.socket = config->api.socket;
    options.warning = milliseconds(100);
    options.guard = true;
    options.hang_margin = kSlowness * DeviceWatch::kMargin;
    options.reconstructor = [this](const ReconstructionTask&) {
      return std::make_unique<fakes::FakeReconstructor>(log);
    };
    thread = std::thread([this, options] {
      result =
          run_daemon({*open->turntable, *open->projector, camera, *open->panel}, options, rig.clock, stop.get_token());
    });
  }
  void TearDown() override {
    stop.request_stop();
    thread.join();
  }
  /// A Reset is refused as long as something is not settled yet, and homing may fail on a busy machine: press again.
  void get_ready() {
    ASSERT_TRUE(rig.wait_for([&] {
      if (!rig.lamp("BUSY")) rig.press("RESET");
      return rig.lamp("START_LAMP");
    })) << ctl::fetch(rig.api(), "/api/v1/status").value_or("no answer");
  }

  WireRig rig{kLight, kFast};
  fakes::TriggerLine line;
  fakes::FakeCamera camera{line, rig.clock};
  fakes::ReconstructionLog log;
  std::unique_ptr<config::RigConfig> config;
  std::unique_ptr<OpenDevices> open;
  std::stop_source stop;
  Result<Ended> result;
  std::thread thread;
};

/// Keeps all cores at work, as a reconstruction does: niced.
class Load {
 public:
  Load() {
    for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i) {
      threads_.emplace_back([this] {
        ::setpriority(PRIO_PROCESS, 0, 10);
        while (!end_) {
        }
      });
    }
  }
  ~Load() { end_ = true; }

 private:
  std::atomic<bool> end_ = false;
  std::vector<std::jthread> threads_;
};

TEST_F(DaemonOnWires, AnEstopIsAStopFrameOnTheWireWhateverTheRigIsDoing) {
  const Load reconstruction;
  std::mt19937 random(1);
  std::vector<double> latencies_ms;
  ASSERT_TRUE(rig.wait_halted());
  for (int round = 0; round < 10; ++round) {
    get_ready();
    rig.press("START");
    rig.clock.sleep_for(milliseconds(std::uniform_int_distribution(0, 1500)(random)));
    const auto pressed = rig.clock.now();
    rig.set_estop(false);
    ASSERT_TRUE(rig.wait_for([&] { return !rig.stops(pressed).empty(); }));
    latencies_ms.push_back(std::chrono::duration<double, std::milli>(rig.stops(pressed).front() - pressed).count());
    ASSERT_TRUE(rig.wait_fault());
    EXPECT_FALSE(rig.drive.truth().moving);
    EXPECT_TRUE(rig.moves(rig.stops(pressed).front()).empty());
    rig.set_estop(true);
    rig.clock.sleep_for(milliseconds(100));
  }
  std::ranges::sort(latencies_ms);
  fmt::print("e-stop edge to stop frame, ms: {:.1f}\n", fmt::join(latencies_ms, " "));
  EXPECT_LE(latencies_ms.at(latencies_ms.size() * 9 / 10 - 1), 100.0);
}

TEST_F(DaemonOnWires, NothingMovesWithoutResetNorWithoutHome) {
  ASSERT_TRUE(rig.wait_halted());
  rig.press("START");
  EXPECT_TRUE(rig.moves({}).empty());
  EXPECT_FALSE(rig.stops({}).empty()) << "the first thing a daemon does";
  get_ready();
  EXPECT_EQ(rig.moves({}).size(), 1u) << "homing";
}

TEST_F(DaemonOnWires, AGuardThatIsOpenedStopsTheTable) {
  ASSERT_TRUE(rig.wait_halted());
  get_ready();
  rig.press("START");
  ASSERT_TRUE(rig.wait_moving());
  const auto opened = rig.clock.now();
  rig.lines->set("GUARD_OK", false);
  ASSERT_TRUE(rig.wait_fault());
  EXPECT_FALSE(rig.stops(opened).empty());
  EXPECT_FALSE(rig.drive.truth().moving);
}

TEST_F(DaemonOnWires, AfterAPulledCableStopIsTheFirstMotionFrameWhenTheDriveIsBack) {
  ASSERT_TRUE(rig.wait_halted());
  get_ready();
  rig.press("START");
  ASSERT_TRUE(rig.wait_moving());
  rig.serial->vanish();
  ASSERT_TRUE(rig.wait_fault());
  EXPECT_FALSE(rig.lamp("DOTS"));
  rig.press("RESET");
  EXPECT_TRUE(rig.lamp("RED")) << "refused: the table may be moving";
  rig.serial->clear_log();
  const auto back = rig.clock.now();
  ASSERT_TRUE(rig.serial->come_back());
  ASSERT_TRUE(rig.wait_for([&] { return !rig.serial->log().empty(); }));
  ASSERT_TRUE(rig.wait_for([&] { return !rig.stops(back).empty(); }));
  EXPECT_EQ(rig.serial->log().front().at, rig.stops(back).front());
  EXPECT_TRUE(rig.moves(back).empty());
  ASSERT_TRUE(rig.wait_for([&] {
    rig.press("RESET");
    return !rig.lamp("RED");
  }));
  EXPECT_TRUE(rig.wait_ready());
}

TEST_F(DaemonOnWires, AnEstopThatSilencesTheDriveReadsAsAnEstop) {
  ASSERT_TRUE(rig.wait_halted());
  get_ready();
  rig.press("START");
  ASSERT_TRUE(rig.wait_moving());
  rig.serial->inject({sim::wire::WireFault::Kind::request_lost});
  rig.clock.sleep_for(milliseconds(30));
  rig.set_estop(false);
  ASSERT_TRUE(rig.wait_fault());
  rig.serial->clear_faults();
  rig.set_estop(true);
  const auto failure = read_file(rig.only_job() / "failure.json");
  ASSERT_TRUE(failure);
  EXPECT_THAT(*failure, testing::HasSubstr("e-stop"));
}

TEST_F(DaemonOnWires, AnEstopDoesNotWaitForASilentDriveToAnswer) {
  ASSERT_TRUE(rig.wait_halted());
  get_ready();
  rig.press("START");
  ASSERT_TRUE(rig.wait_moving());
  rig.serial->inject({sim::wire::WireFault::Kind::reply_lost});
  rig.clock.sleep_for(milliseconds(80));  // longer than a reply may take: the driver waits for a quiet bus
  const auto pressed = rig.clock.now();
  rig.set_estop(false);
  ASSERT_TRUE(rig.wait_for([&] { return !rig.stops(pressed).empty(); }));
  EXPECT_LT(rig.stops(pressed).front() - pressed, milliseconds(100));
  ASSERT_TRUE(rig.wait_fault());
}

TEST_F(DaemonOnWires, APanelThatVanishesAndComesBackNeedsNoRestart) {
  ASSERT_TRUE(rig.wait_halted());
  get_ready();
  rig.press("START");
  ASSERT_TRUE(rig.wait_moving());
  const auto gone = rig.clock.now();
  rig.lines.reset();
  ASSERT_TRUE(rig.wait_for([&] { return !rig.stops(gone).empty(); }));
  rig.plug_in_lines();
  ASSERT_TRUE(rig.wait_fault());
  EXPECT_TRUE(rig.wait_for([&] {  // the projector returns at the next request
    rig.press("RESET");
    return rig.lamp("BUSY");
  }));
  EXPECT_TRUE(rig.wait_ready());
}

}  // namespace
}  // namespace scanrig
