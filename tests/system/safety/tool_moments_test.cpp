#include <cstdlib>
#include <memory>
#include <mutex>
#include <random>
#include <thread>

#include "tests/system/safety/tool_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// Ways to end a run.
enum class Way { interrupt, terminate, kill, pull_cable };
constexpr Way kWays[] = {Way::interrupt, Way::terminate, Way::kill, Way::pull_cable};

constexpr std::size_t kAtOnce = 8;  ///< concurrent runs, each on its own rig; with more, the rigs themselves reply late
constexpr auto kStandstill = kSlowness * seconds(1);
constexpr seconds kWarning{2};

std::string to_string(Way way) {
  switch (way) {
    case Way::interrupt: return "SIGINT";
    case Way::terminate: return "SIGTERM";
    case Way::kill: return "SIGKILL";
    case Way::pull_cable: break;
  }
  return "cable";
}

int moments() {
  const char* const wanted = std::getenv("SCANRIG_MOMENTS");
  return wanted == nullptr ? 4 : std::atoi(wanted);
}

struct Run {
  Way way;
  Clock::Duration moment;  ///< from the start of the tool
  Clock::Duration moving_for{};
  bool was_moving = false;
};

/// The rules for one run of `tool` that is ended in one way at one moment.
class Ending {
 public:
  Ending(const Tool& tool, Run& run) : tool_(tool), run_(run) {}

  void perform() {
    const auto started = rig_.clock.now();
    bench_.start(tool_);
    rig_.clock.sleep_until(started + run_.moment);
    run_.was_moving = bench_.is_moving();
    if (run_.way == Way::pull_cable) return pull_cable();
    const auto event = rig_.clock.now();
    bench_.signal(run_.way == Way::interrupt ? SIGINT : run_.way == Way::terminate ? SIGTERM : SIGKILL);
    run_.moving_for = bench_.moving_after(event, kStandstill + milliseconds(300));
    const int code = bench_.wait();
    EXPECT_LT(run_.moving_for, kStandstill) << name();
    EXPECT_FALSE(bench_.is_moving()) << name();
    if (!run_.was_moving) return;
    ASSERT_FALSE(rig_.stops(event).empty()) << name();
    EXPECT_TRUE(rig_.moves(rig_.stops(event).front()).empty()) << name();
    EXPECT_EQ(code, run_.way == Way::kill ? -1 : 10) << name();
    EXPECT_TRUE(rig_.wait_for([&] { return rig_.lamp("RED"); })) << name();
    EXPECT_TRUE(rig_.wait_for([&] { return bench_.guardian() == 0; })) << name();
  }

 private:
  [[nodiscard]] std::string name() const {
    return fmt::format("{} {} after {} ms: {}", fmt::join(tool_, " "), to_string(run_.way),
                       std::chrono::duration_cast<milliseconds>(run_.moment).count(), bench_.output());
  }
  void pull_cable() {
    rig_.serial->vanish();
    rig_.clock.sleep_for(milliseconds(300));
    rig_.serial->clear_log();
    const auto back = rig_.clock.now();
    ASSERT_TRUE(rig_.serial->come_back());
    if (!run_.was_moving) {  // it may still start, or fail: only its end counts
      bench_.wait();
      EXPECT_FALSE(bench_.is_moving()) << name();
      return;
    }
    run_.moving_for = bench_.moving_after(back, kStandstill + milliseconds(300));
    EXPECT_EQ(bench_.wait(), 5) << name();
    EXPECT_FALSE(bench_.is_moving()) << name();
    ASSERT_FALSE(rig_.stops(back).empty()) << name();
    EXPECT_LT(run_.moving_for, kStandstill)
        << "first stop after " << std::chrono::duration_cast<milliseconds>(rig_.stops(back).front() - back).count()
        << " ms: " << name();
    EXPECT_EQ(rig_.serial->log().front().at, rig_.stops(back).front()) << "the first frame is not stop: " << name();
    EXPECT_TRUE(rig_.moves(back).empty()) << name();
  }

  const Tool& tool_;
  Run& run_;
  ToolBench bench_;
  WireRig& rig_ = bench_.rig;
};

/// Duration of an undisturbed run that ends with `code`.
Clock::Duration undisturbed(const Tool& tool, int code) {
  ToolBench bench;
  const auto started = bench.rig.clock.now();
  EXPECT_EQ(bench.run(tool), code) << bench.output();
  EXPECT_FALSE(bench.is_moving());
  return bench.rig.clock.now() - started;
}

void end_at_random_moments(const Tool& tool, unsigned seed, int code = 0) {
  const auto whole = undisturbed(tool, code);
  std::mt19937 random(seed);
  std::vector<Run> runs;
  for (const Way way : kWays) {
    for (int i = 0; i < moments(); ++i) {
      const bool in_warning = i % 5 == 4;  // the moves are the most important part
      const auto from = in_warning ? Clock::Duration::zero() : Clock::Duration(kWarning);
      const auto to = in_warning ? Clock::Duration(kWarning) : whole;
      const double share = std::uniform_real_distribution(0.0, 1.0)(random);
      runs.push_back({way, from + std::chrono::duration_cast<Clock::Duration>(share * (to - from))});
    }
  }
  for (std::size_t first = 0; first < runs.size(); first += kAtOnce) {
    std::vector<std::jthread> at_once;
    for (auto i = first; i < std::min(first + kAtOnce, runs.size()); ++i) {
      at_once.emplace_back([&, i] { Ending(tool, runs[i]).perform(); });
    }
  }
  for (const Way way : kWays) {
    Clock::Duration longest{};
    int moving = 0;
    for (const auto& run : runs) {
      if (run.way != way) continue;
      moving += run.was_moving ? 1 : 0;
      longest = std::max(longest, run.moving_for);
    }
    fmt::print("{}: {} at {} moments, {} while moving; longest until standstill {} ms\n", fmt::join(tool, " "),
               to_string(way), moments(), moving, std::chrono::duration_cast<milliseconds>(longest).count());
  }
}

TEST(ToolMoments, HomeLeavesTheTableStoppedWheneverAndHoweverItEnds) { end_at_random_moments(kHome, 1); }

TEST(ToolMoments, AMoveLeavesTheTableStoppedWheneverAndHoweverItEnds) { end_at_random_moments(kMove, 2); }

TEST(ToolMoments, TheDoctorLeavesTheTableStoppedWheneverAndHoweverItEnds) {
  constexpr int kHasFindings = 5;  // this rig has no cameras
  end_at_random_moments(kDoctor, 3, kHasFindings);
}

}  // namespace
}  // namespace scanrig
