#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "sim/wire/loopback.h"
#include "tests/component/camera/aravis_bench.h"

/// triggers COUNT: the shipped driver over two GigE cameras, where 1 % of the frames are lost, 1 % late, 1 % torn and
/// 0.5 % older ones. Takes COUNT good pairs and prints the counts of returned and rejected frames as one line of JSON.
namespace scanrig::bench {
namespace {

constexpr int kReplyTimeout = 20;  ///< consecutive exposures that may fail

struct Seen {
  int good = 0, wrong = 0, named = 0;
  std::vector<double> overhead_ms;  ///< arm and collect of good pairs: time of an exposure without light and motion
};

double milliseconds(Clock::Duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

Result<Seen> take(AravisBench& bench, int count) {
  Seen seen;
  for (int failed = 0; seen.good < count;) {
    const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(5));
    const auto begun = bench.clock().now();
    if (auto armed = bench.camera().arm(deadline); !armed) return pass_on(armed);
    const auto armed_at = bench.clock().now();
    const auto number = bench.fire();
    const auto fired_at = bench.clock().now();
    const auto frame = bench.camera().collect(deadline);
    if (!frame) {
      ++seen.named;
      if (++failed > kReplyTimeout) return pass_on(frame);
      continue;
    }
    failed = 0;
    ++seen.good;
    seen.wrong += bench.number_in(frame->left) != number || bench.number_in(frame->right) != number;
    seen.overhead_ms.push_back(milliseconds(armed_at - begun + (bench.clock().now() - fired_at)));
  }
  return seen;
}

int run(int count) {
  AravisBench bench([](AravisOptions& options) { options.frame_timeout = std::chrono::milliseconds(150); }, 250);
  if (!bench.opened()) {
    fmt::print(stderr, "{}\n", bench.opened().error().message);
    return 1;
  }
  bench.far().tell("rates 0.01 0.01 0.01 0.005 20");
  auto seen = take(bench, count);
  if (!seen) {
    fmt::print(stderr, "{}\n", seen.error().message);
    return 1;
  }
  std::ranges::sort(seen->overhead_ms);
  const TriggerCounts& counts = bench.camera().counts();
  fmt::print(
      R"({{"good": {}, "wrong": {}, "named": {}, "happened": "{}", "lost": {}, "torn": {}, "old": {}, "odd": {}, )"
      R"("strays": {}, "warm_up": {}, "overhead_p95_ms": {:.3f}}})"
      "\n",
      seen->good, seen->wrong, seen->named, bench.far().tell("counts"), counts.lost, counts.torn, counts.old,
      counts.odd, counts.strays, counts.warm_up, seen->overhead_ms[seen->overhead_ms.size() * 95 / 100]);
  return 0;
}

}  // namespace
}  // namespace scanrig::bench

int main(int argc, char** argv) {
  if (const auto own = scanrig::sim::wire::enter_own_loopback(); !own) {
    fmt::print(stderr, "{}\n", own.error().message);
    return 77;
  }
  return scanrig::bench::run(argc > 1 ? std::atoi(argv[1]) : 10000);
}
