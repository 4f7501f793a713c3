#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sim/scene/calibration_series.h"

namespace scanrig::sim {

/// Other exposures of the pattern that the cameras of a workshop offer: 96 and 3 ms beside 12 ms.
inline const std::vector<double> kWorkshopPatternFactors{8.0, 0.25};

/// Options of the command line for a drawn rig, `--rig-seed` and `--rig`. They refer to this object.
struct DrawnRigOptions {
  std::uint64_t seed = 0;  ///< 0: the default rig
  std::string changes;     ///< NAME=NUMBER, as in kRigVariationNames

  void add_to(CLI::App& app);
  /// The variation; nothing for the default rig. Fails as set_by_name, and with `invalid_input` (changes of no rig).
  [[nodiscard]] Result<std::optional<RigVariation>> variation() const;
};

/// Options of the command line for the profile of the simulated rig. They refer to this object.
struct ProfileOptions {
  std::string profile = "laboratory", without, with, material, screen = "blue";
  double gamma = 1.0;
  bool is_cold = false;

  /// `has_object`: of a rig with an object on its table, so with materials and handling.
  void add_to(CLI::App& app, bool has_object);
  /// Fails as choose_effects, and with `invalid_input` (a material or a cold rig of profile 1), `out_of_range` (gamma).
  [[nodiscard]] Result<ChosenProfile> chosen() const;
};

/// Options of the verb `shoot-board`. They refer to this object.
struct ShootBoardOptions {
  SeriesOptions series;
  DrawnRigOptions rig;
  ProfileOptions profile;
  std::string folder, print, faults;
  std::string board = "12x9";

  void add_to(CLI::App& app);
  /// Fails as set_by_name and ProfileOptions, and with `invalid_input` (board).
  [[nodiscard]] Result<SeriesOptions> chosen() const;
};

}  // namespace scanrig::sim
