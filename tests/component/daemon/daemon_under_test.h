#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "core/virtual_clock.h"
#include "daemon/service/run_daemon.h"
#include "tests/component/daemon/fake_reconstructor.h"
#include "tests/component/daemon/fake_rig.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {

/// A whole daemon over fake devices on a virtual clock; the test is the operator, and time waits for it too.
class Daemon : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    options.jobs = {.root = folder_ / "jobs", .calibration_file = folder_ / "calibration.json"};
    options.recipes["default"].views = 3;
    options.api.socket = folder_ / "api.sock";
    options.on_loop = [this](ControlLoop& l) { loop = &l; };
    options.reconstructor = [this](const ReconstructionTask&) {
      return std::make_unique<fakes::FakeReconstructor>(log);
    };
  }
  void TearDown() override {
    rig.panel.hang(false);
    if (thread.joinable()) shut_down();
    FolderTest::TearDown();
  }
  void boot() {
    const Clock::Busy until_it_runs(clock);
    thread = std::thread([this] { result = run_daemon(devices(), options, clock, stop.get_token()); });
    rig.panel.wait_attached();
    at_the_rig.emplace(clock);
  }
  virtual Devices devices() { return rig.devices(); }
  void shut_down() {
    at_the_rig.reset();
    stop.request_stop();
    thread.join();
    rig.panel.detach();
    stop = std::stop_source();
  }

  bool wait_ready() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.green && !l.busy; });
  }
  bool wait_flip() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.flip_request; });
  }
  bool wait_halted() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.amber && !l.busy && !l.start_lamp; });
  }
  /// Presses Start; the e-stop ends the exposure after `exposures` more, then it is released.
  void start_until_estop(int exposures) {
    rig.line.fires_before = exposures;
    rig.line.at_fire = [this] {
      rig.panel.set(&PanelInputs::estop_ok, false);
      clock_waits_for([this] { return loop->snapshot()->machine == MachineState::error; });
    };
    rig.panel.press(&PanelInputs::start);
    EXPECT_TRUE(wait_fault());
    rig.panel.set(&PanelInputs::estop_ok, true);
  }
  bool wait_fault() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.red && !l.busy; });
  }
  bool wait_busy() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.busy && l.green; });
  }
  bool wait_pass() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.pass && l.start_lamp; });
  }
  bool wait_fail() {
    return rig.panel.wait_for_lamps([](const auto& l) { return l.fail && l.start_lamp; });
  }
  void get_ready() {
    ASSERT_TRUE(wait_halted());
    rig.panel.press(&PanelInputs::reset);
    ASSERT_TRUE(wait_ready());
  }
  void scan_both_poses() {
    rig.panel.press(&PanelInputs::start);
    ASSERT_TRUE(wait_flip());
    rig.panel.press(&PanelInputs::start);
  }

  /// Checks repeatedly, for a virtual minute at most; a check takes no time.
  bool clock_waits_for(const std::function<bool()>& as_wanted) {
    for (const auto by = Deadline::after(clock, std::chrono::seconds(60)); !by.expired(clock);
         clock.sleep_for(std::chrono::milliseconds(10))) {
      const Clock::Busy looking(clock);
      if (as_wanted()) return true;
    }
    return false;
  }
  std::vector<std::filesystem::path> job_folders() const {
    std::vector<std::filesystem::path> folders;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "jobs")) {
      if (entry.is_directory()) folders.push_back(entry.path());
    }
    std::ranges::sort(folders);
    return folders;
  }
  ScanFolder only_job() const {
    const auto folders = job_folders();
    EXPECT_EQ(folders.size(), 1u);
    auto scan = ScanFolder::open(folders.at(0));
    EXPECT_TRUE(scan) << scan.error().message;
    return std::move(*scan);
  }
  void expect_all_stored_views_readable(const ScanFolder& scan) {
    for (std::size_t pose = 0; pose < scan.manifest().poses.size(); ++pose) {
      for (std::size_t view = 0; view < scan.manifest().poses[pose].views.size(); ++view) {
        // The sample calibration is for images of the fakes' size.
        EXPECT_TRUE(scan.load_images(pose, view)) << pose << "/" << view;
      }
    }
  }

  /// The daemon's reply to an order, a job request or a press over the API; it has an hour of the clock.
  template <class Asked>
  Result<std::string> ask(const Asked& what) {
    struct Waiting {
      std::mutex mutex;
      std::condition_variable changed;
      std::optional<Result<std::string>> answer{};
    };
    const auto waiting = std::make_shared<Waiting>();
    const auto reply = [this, waiting](const Result<std::string>& answer) {
      {
        const std::lock_guard guard(waiting->mutex);
        waiting->answer = answer;
      }
      clock.notify_all(waiting->changed);
    };
    if constexpr (std::is_same_v<Asked, Button>) {
      loop->press(what, Origin::remote, reply);
    } else if constexpr (std::is_same_v<Asked, JobOrder>) {
      loop->order(what, reply);
    } else {
      loop->ask(what, reply);
    }
    std::unique_lock lock(waiting->mutex);
    clock.wait_until(lock, waiting->changed, clock.now() + std::chrono::hours(1),
                     [&] { return waiting->answer.has_value(); });
    return waiting->answer.value_or(fail(ErrorCode::timeout, "no answer"));
  }
  std::shared_ptr<const JobInfo> job(const std::string& id) const {
    const auto jobs = loop->snapshot()->jobs;
    return jobs.contains(id) ? jobs.at(id) : nullptr;
  }
  /// The newest job's, or nothing.
  std::shared_ptr<const JobInfo> newest() const {
    const auto jobs = loop->snapshot()->jobs;
    return jobs.empty() ? nullptr : jobs.rbegin()->second;
  }
  bool wait_state(const std::string& id, JobState state) {
    for (int second = 0; second < 3600; ++second) {
      const auto found = job(id);
      if (found && found->state == state) return true;
      clock.sleep_for(std::chrono::seconds(1));
    }
    return false;
  }

  VirtualClock clock;
  fakes::FakeRig rig{clock};
  fakes::ReconstructionLog log;
  DaemonOptions options;
  ControlLoop* loop = nullptr;
  std::stop_source stop;
  Result<Ended> result;
  std::thread thread;
  std::optional<Clock::Actor> at_the_rig;  ///< while the daemon runs
};

}  // namespace scanrig
