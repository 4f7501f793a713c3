#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "sim/wire/loopback.h"
#include "tests/bench/fault_matrix/cells.h"

/// fault_matrix PROFILES SCRATCH WORKERS motion|cameras: every cell of that part of the fault matrix, one line of JSON
/// per cell.
namespace scanrig::bench {

bool soon(Clock& clock, Clock::Duration limit, const std::function<bool()>& holds) {
  for (const auto by = Deadline::after(clock, limit); !holds(); clock.sleep_for(std::chrono::milliseconds(1))) {
    if (by.expired(clock)) return false;
  }
  return true;
}

Outcome timed(Clock& clock, Clock::Duration limit, const std::vector<ErrorCode>& named,
              const std::function<Result<void>(Deadline)>& call) {
  Outcome outcome;
  const auto begun = clock.now();
  const auto done = call({begun + limit});
  const auto over = clock.now() - begun - limit;
  outcome.hung = over > std::chrono::seconds(5);
  outcome.expect(over <= kGrace,
                 fmt::format("{:.0f} ms past its deadline", std::chrono::duration<double, std::milli>(over).count()));
  outcome.told = done ? "ok" : fmt::format("{}: {}", to_string(done.error().code), done.error().message);
  if (named.empty()) {
    outcome.expect(done.has_value(), "did not succeed");
  } else {
    outcome.expect(!done && std::ranges::find(named, done.error().code) != named.end(), "not in its named error");
  }
  return outcome;
}

namespace {

std::string line_of(const Cell& cell, const Outcome& outcome) {
  const auto* fault = std::ranges::find(kFaults, cell.fault, [](const auto& pair) { return pair.first; })->second;
  const nlohmann::ordered_json line{{"driver", cell.driver},
                                    {"device", cell.device},
                                    {"method", cell.method},
                                    {"fault", fault},
                                    {"applicable", outcome.applicable},
                                    {"held", outcome.wrongs.empty()},
                                    {"hung", outcome.hung},
                                    {"wrong_position", outcome.wrong_position},
                                    {"told", outcome.told},
                                    {"wrongs", outcome.wrongs}};
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<Cell> motion_cells(const std::filesystem::path& profiles, const std::filesystem::path& scratch) {
  std::vector<Cell> cells = turntable_cells(scratch, profiles);
  std::ranges::move(projector_cells(scratch), std::back_inserter(cells));
  std::ranges::move(panel_cells(scratch), std::back_inserter(cells));
  return cells;
}

std::vector<Cell> eye_cells() {
  std::vector<Cell> cells = camera_cells();
  std::ranges::move(lightcrafter_cells(), std::back_inserter(cells));
  return cells;
}

void run(const std::vector<Cell>& cells, int workers) {
  std::atomic<std::size_t> next = 0;
  std::mutex output;
  std::vector<std::jthread> crew;
  for (int worker = 0; worker < workers; ++worker) {
    crew.emplace_back([&] {
      for (std::size_t i = next++; i < cells.size(); i = next++) {
        const std::string line = line_of(cells[i], cells[i].run());
        const std::scoped_lock lock(output);
        std::puts(line.c_str());
        std::fflush(stdout);
      }
    });
  }
}

}  // namespace
}  // namespace scanrig::bench

int main(int argc, char** argv) {
  using namespace scanrig;
  if (argc != 5) {
    std::fputs("usage: fault_matrix PROFILES SCRATCH WORKERS motion|cameras\n", stderr);
    return static_cast<int>(ExitCode::usage);
  }
  const bool cameras = argv[4] == std::string_view("cameras");
  if (cameras) {
    if (const auto own = sim::wire::enter_own_loopback(); !own) {
      fmt::print(stderr, "{}\n", own.error().message);
      return 77;
    }
  }
  bench::run(cameras ? bench::eye_cells() : bench::motion_cells(argv[1], argv[2]), std::max(1, std::atoi(argv[3])));
  return 0;
}
