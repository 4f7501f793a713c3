// Cost of storing a view during a scan: a daemon over the simulated rig on the real clock, full-size images, the real
// reconstruction beside it.
//   station_view_cost FOLDER JOBS   a line for each view of JOBS jobs but its first: milliseconds from the
//                                   last frame of the view before, in memory, to the command of the next
//                                   move
// Includes everything the daemon does between two views. Rendering is excluded: images of the first job are reused.
#include <atomic>
#include <charconv>
#include <cstdio>
#include <thread>
#include <vector>

#include "daemon/jobs/executors.h"
#include "daemon/service/run_daemon.h"
#include "sim/devices/sim_rig.h"

namespace {

using namespace scanrig;

constexpr int kViews = 8;
constexpr int kMoves = kViews + 1;  // view 0 is repeated
constexpr std::size_t kExposures = 2 * kMoves;
constexpr auto kReadout = std::chrono::milliseconds(25);
constexpr auto kLimit = std::chrono::minutes(5);

/// Keeps the frames of the first job and returns them again in all others.
class ReplayedCamera final : public StereoCamera {
 public:
  ReplayedCamera(StereoCamera& camera, Clock& clock) : camera_(camera), clock_(clock) {}
  Result<void> prepare(Deadline deadline) override { return camera_.prepare(deadline); }
  Result<void> arm(Deadline deadline) override { return camera_.arm(deadline); }
  Result<StereoFrame> capture_preview(Deadline deadline) override { return camera_.capture_preview(deadline); }
  Result<StereoFrame> collect(Deadline deadline) override {
    const auto number = exposures_++ % kExposures;
    if (frames_.size() == kExposures) {
      clock_.sleep_for(kReadout);
      auto frame = frames_[number];
      frame.taken = last_ = clock_.now();
      return frame;
    }
    auto frame = camera_.collect(deadline);
    if (frame) frames_.push_back(*frame);
    last_ = clock_.now();
    return frame;
  }
  [[nodiscard]] Clock::TimePoint last() const { return last_; }

 private:
  StereoCamera& camera_;
  Clock& clock_;
  std::vector<StereoFrame> frames_;
  std::size_t exposures_ = 0;
  Clock::TimePoint last_;
};

/// Notes how long the table was stopped; in the thread that owns the devices.
class TimedTurntable final : public Turntable {
 public:
  TimedTurntable(Turntable& table, const ReplayedCamera& camera, Clock& clock)
      : table_(table), camera_(camera), clock_(clock) {}
  Result<void> home(Deadline deadline) override { return table_.home(deadline); }
  Result<Move> rotate_to(Degrees target, Deadline deadline) override {
    const std::chrono::duration<double, std::milli> stood = clock_.now() - camera_.last();
    if (moves_ >= kMoves && moves_ % kMoves != 0) std::printf("%.3f\n", stood.count());
    ++moves_;
    return table_.rotate_to(target, deadline);
  }
  Result<void> stop(Deadline deadline) override { return table_.stop(deadline); }
  Result<void> reset_alarm(Deadline deadline) override { return table_.reset_alarm(deadline); }
  Result<TurntableStatus> status(Deadline deadline) override { return table_.status(deadline); }
  void request_stop() noexcept override { table_.request_stop(); }
  void drop_stop_request() noexcept override { table_.drop_stop_request(); }

 private:
  Turntable& table_;
  const ReplayedCamera& camera_;
  Clock& clock_;
  int moves_ = 0;
};

class Shift {
 public:
  Shift(const std::filesystem::path& folder, sim::SimRig& rig, Clock& clock) : rig_(rig), clock_(clock) {
    options_.jobs = {.root = folder / "jobs", .calibration_file = folder / "calibration.json"};
    options_.recipes["default"] = {.poses = 1, .views = kViews};
    options_.api.socket = folder / "api.sock";
    options_.reconstructor = pipeline_reconstructor({});
  }

  Result<void> work(int jobs) {
    std::stop_source stop;
    Result<Ended> ended;
    std::thread daemon([&] {
      ended = run_daemon({table_, rig_.projector(), camera_, rig_.panel()}, options_, clock_, stop.get_token());
      over_ = true;
    });
    bool done = wait([](const auto& l) { return l.amber && !l.busy; });
    rig_.press_reset();
    for (int job = 0; job <= jobs && done; ++job) {  // the first makes the images
      done = wait([](const auto& l) { return l.start_lamp; });
      rig_.press_start();
      done = done && wait([](const auto& l) { return !l.start_lamp; });
    }
    done = done && wait([](const auto& l) { return l.start_lamp; });
    stop.request_stop();
    daemon.join();
    if (ended && !done) return fail(ErrorCode::timeout, "a job did not come to its end");
    return ended ? Result<void>() : pass_on(ended);
  }

 private:
  template <class Wanted>
  bool wait(const Wanted& wanted) {
    for (const auto end = Deadline::after(clock_, kLimit); !end.expired(clock_) && !over_;
         clock_.sleep_for(std::chrono::milliseconds(20))) {
      if (wanted(rig_.lamps())) return true;
    }
    return false;
  }

  sim::SimRig& rig_;
  Clock& clock_;
  ReplayedCamera camera_{rig_.camera(), clock_};
  TimedTurntable table_{rig_.turntable(), camera_, clock_};
  DaemonOptions options_;
  std::atomic<bool> over_ = false;
};

Result<void> measure(const std::filesystem::path& folder, int jobs) {
  RealClock clock;
  sim::SimRigOptions options;
  options.poses = 1;
  auto rig = sim::SimRig::create(options, clock);
  if (!rig) return pass_on(rig);
  if (auto written = (*rig)->write_calibration(folder / "calibration.json"); !written) return written;
  return Shift(folder, **rig, clock).work(jobs);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string_view count = argv[2];
  int jobs = 0;
  std::from_chars(count.data(), count.data() + count.size(), jobs);
  const auto done = measure(argv[1], jobs);
  if (!done) fmt::print(stderr, "station_view_cost: {}\n", done.error().message);
  return done ? 0 : 1;
}
