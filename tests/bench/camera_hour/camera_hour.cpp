#include <fmt/format.h>

#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "daemon/rig/rig_thread.h"
#include "sim/wire/loopback.h"
#include "tests/component/camera/aravis_bench.h"
#include "tests/component/daemon/fake_rig.h"
#include "tests/resident_memory.h"

/// camera_hour SECONDS: the daemon's rig thread over two GigE cameras, alternating ten seconds of scan and of live
/// preview, both at 10 frames/s of each camera. Prints a line of JSON every two seconds: memory, descriptors, work
/// done. The last line follows the release of the cameras. It also has `before`, the descriptors before they were
/// opened for the second time.
namespace scanrig::bench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kFrame{100};
constexpr seconds kTurn{10};
constexpr seconds kSample{2};

/// The line of the bench's cameras.
class BenchProjector final : public Projector {
 public:
  explicit BenchProjector(AravisBench& bench) : bench_(bench) {}
  Result<void> fire(Light, Deadline) override {
    bench_.fire();
    return {};
  }
  Result<void> turn_off(Deadline) override { return {}; }
  void request_off() noexcept override {}

 private:
  AravisBench& bench_;
};

std::ptrdiff_t descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

/// Waits for the rig's reply to the last command.
class Answers {
 public:
  void tell(const Event& event) {
    const std::scoped_lock lock(mutex_);
    if (const auto* failed = std::get_if<event::RigFailed>(&event)) {
      ++failed_;
      std::fprintf(stderr, "%s\n", failed->error.message.c_str());
    }
    answered_ = true;
    changed_.notify_all();
  }
  bool wait() {
    std::unique_lock lock(mutex_);
    const bool came = changed_.wait_for(lock, seconds(60), [this] { return answered_; });
    answered_ = false;
    return came;
  }
  int failed() {
    const std::scoped_lock lock(mutex_);
    return failed_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool answered_ = false;
  int failed_ = 0;
};

struct Done {
  int frames = 0;    ///< of each camera, in scans
  int previews = 0;  ///< of each camera, in previews
  int failed = 0;
};

void print(double at_s, const Done& done) {
  fmt::print(R"({{"at_s": {:.1f}, "resident_kib": {}, "descriptors": {}, "frames": {}, "previews": {}, "failed": {}}})"
             "\n",
             at_s, resident_kib(), descriptors(), done.frames, done.previews, done.failed);
  std::fflush(stdout);
}

int work(seconds time, Done& done) {
  AravisBench bench;
  if (!bench.opened()) {
    fmt::print(stderr, "{}\n", bench.opened().error().message);
    return 1;
  }
  Clock& clock = bench.clock();
  fakes::TriggerLine line;
  fakes::FakeTurntable turntable(clock);
  fakes::FakePanel panel(clock);
  BenchProjector projector(bench);
  bool scanning = false;
  Preview preview(clock, [&] { return !scanning; });
  Answers answers;
  RigThread rig({turntable, projector, bench.camera(), panel}, clock, {}, preview,
                [&](const Event& event) { answers.tell(event); });
  rig.home();
  if (!answers.wait()) return 1;
  const auto begun = clock.now();
  auto next = begun, sample = begun;
  while (clock.now() - begun < time) {
    scanning = (clock.now() - begun) / kTurn % 2 == 0;
    if (scanning) {
      rig.take_view({{"job", 0, 0}, {0.0}});
      if (!answers.wait()) return 1;
      done.frames += 2;
      next += 2 * kFrame;
    } else {
      if (preview.jpeg(Side::left) && preview.jpeg(Side::right)) ++done.previews;
      next += kFrame;
    }
    next = std::max(next, clock.now());
    clock.sleep_until(next);
    done.failed = answers.failed();
    if (clock.now() < sample) continue;
    sample += kSample;
    print(std::chrono::duration<double>(clock.now() - begun).count(), done);
  }
  return 0;
}

int run(seconds time) {
  Done done;
  // The libraries keep some descriptors permanently from their first use on.
  if (const int failed = work(seconds(1), done); failed != 0) return failed;
  const auto before = descriptors();
  done = {};
  if (const int failed = work(time, done); failed != 0) return failed;
  fmt::print(R"({{"before": {}, "after": {}}})"
             "\n",
             before, descriptors());
  return 0;
}

}  // namespace
}  // namespace scanrig::bench

int main(int argc, char** argv) {
  if (const auto own = scanrig::sim::wire::enter_own_loopback(); !own) {
    fmt::print(stderr, "{}\n", own.error().message);
    return 77;
  }
  return scanrig::bench::run(std::chrono::seconds(argc > 1 ? std::atoi(argv[1]) : 3600));
}
