#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/bench/fault_matrix/cells.h"

/// fault_matrix PROFILES SCRATCH [WORKERS]: every cell of the fault matrix, one line of JSON each.
namespace scanrig::bench {

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

int run(const std::filesystem::path& profiles, const std::filesystem::path& scratch, int workers) {
  std::vector<Cell> cells = turntable_cells(scratch, profiles);
  std::ranges::move(projector_cells(scratch), std::back_inserter(cells));
  std::ranges::move(panel_cells(scratch), std::back_inserter(cells));
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
  return 0;
}

}  // namespace
}  // namespace scanrig::bench

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: fault_matrix PROFILES SCRATCH [WORKERS]\n", stderr);
    return 2;
  }
  return scanrig::bench::run(argv[1], argv[2], argc > 3 ? std::max(1, std::atoi(argv[3])) : 4);
}
