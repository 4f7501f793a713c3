#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "sim/scene/calibration_series.h"

namespace scanrig::sim {

/// Options of the command line for a drawn rig, `--rig-seed` and `--rig`. They refer to this object.
struct DrawnRigOptions {
  std::uint64_t seed = 0;  ///< 0: the default rig
  std::string changes;     ///< NAME=NUMBER, as in kRigVariationNames

  void add_to(CLI::App& app);
  /// The variation; nothing for the default rig. Fails as set_by_name, and with `invalid_input` (changes of no rig).
  [[nodiscard]] Result<std::optional<RigVariation>> variation() const;
};

/// Options of the verb `shoot-board`. They refer to this object.
struct ShootBoardOptions {
  SeriesOptions series;
  DrawnRigOptions rig;
  std::string folder, print, faults;
  std::string board = "12x9";

  void add_to(CLI::App& app);
  /// Fails as set_by_name, and with `invalid_input` (board).
  [[nodiscard]] Result<SeriesOptions> chosen() const;
};

}  // namespace scanrig::sim
