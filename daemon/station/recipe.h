#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace scanrig {

/// Limits that a model must reach to pass.
struct Limits {
  std::optional<double> min_measured_share{};  ///< of the model's area that cameras saw, 0 to 1
  std::optional<double> max_residual_mm{};     ///< median distance between a pose's views, the worst pose
  bool operator==(const Limits&) const = default;
};

/// Settings for scanning one kind of object. A job keeps the recipe it was queued with.
struct Recipe {
  std::string name = "default";
  int poses = 2;
  int views = 8;                          ///< per pose, at equal angles
  std::chrono::minutes flip_timeout{30};  ///< then the job is parked and the rig is free
  bool flip_by_signal = false;            ///< the panel's `flipped` input reports that the object was turned over
  bool start_on_part = false;             ///< the queue continues when `part_present` falls and rises again
  Limits limits{};
  bool operator==(const Recipe&) const = default;
};

}  // namespace scanrig
