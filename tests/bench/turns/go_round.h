#pragma once

#include <filesystem>
#include <string>

namespace scanrig::bench {

/// True results for a table that was turned round and round.
struct Seen {
  int turns = 0;
  double drift_deg = 0;        ///< of the table at the end of a turn, against the first
  double worst_angle_deg = 0;  ///< measured angle of the driver against the true angle
  double longest_way_deg = 0;
  std::string error{};
};

/// A shipped driver turns the simulated table of its drive on a clock that runs faster than the wall's: from home, or
/// with the drive's counter `preload_turns` away from it. `drive`: "grbl", or a profile in `profiles`.
Seen go_round(const std::string& drive, const std::filesystem::path& profiles, const std::filesystem::path& port,
              int turns, int preload_turns, bool up);

}  // namespace scanrig::bench
