#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include "tests/bench/turns/go_round.h"

/// turns PROFILE|grbl PORT TURNS PRELOAD_TURNS up|down: the results as one line of JSON.
int main(int argc, char** argv) {
  if (argc != 6) {
    std::fputs("usage: turns PROFILE|grbl PORT TURNS PRELOAD_TURNS up|down\n", stderr);
    return 2;
  }
  const std::filesystem::path profile = argv[1];
  const auto seen = scanrig::bench::go_round(profile.stem(), profile.parent_path(), argv[2], std::atoi(argv[3]),
                                             std::atoi(argv[4]), std::string_view(argv[5]) == "up");
  fmt::print("{{\"turns\": {}, \"drift_deg\": {:.5f}, \"worst_angle_deg\": {:.5f}, \"longest_way_deg\": {:.2f}}}\n",
             seen.turns, seen.drift_deg, seen.worst_angle_deg, seen.longest_way_deg);
  if (!seen.error.empty()) fmt::print(stderr, "turns: {}\n", seen.error);
  return seen.error.empty() ? 0 : 5;
}
