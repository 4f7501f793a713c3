#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/station/states.h"

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

struct StoredView {
  int pose = 0;
  int view = 0;
  double measured_deg = 0.0;
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
  double commanded_deg = 0.0;
  double settling_ms = 0.0;  ///< from in-position to stopped
};

struct StageShare {
  std::string name;
  double fraction = 0.0;
};

/// Result of comparing view 0, taken again, with the views since: a movement check, or the check before a resume.
struct MovementCheck {
  int pose = 0;
  double shift_px = 0.0;                ///< of the visible image, the larger of both cameras
  double changed = 0.0;                 ///< share of the visible image that looks different, 0 to 1
  bool unmoved = true;                  ///< object, table and cameras are where they were
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
};

/// Data of one job.
struct JobInfo {
  std::string id{};
  std::string folder{};
  JobState state = JobState::queued;
  Recipe recipe{};
  std::string part{};      ///< from the order: barcode text or what the operator typed; may be empty
  std::int64_t place = 0;  ///< in the queue: the smallest comes first
  int complete = 0;        ///< poses with all their views
  std::vector<StoredView> stored{};
  std::vector<std::string> config_sha256{};  ///< of each configuration they were taken under
  std::vector<MovementCheck> movement_checks{};
  bool quarantined = false;          ///< two daemons died during its reconstruction: only `reprocess` tries again
  bool exported = false;             ///< a client has fetched what it needs
  std::optional<bool> passed{};      ///< done: whether the model is within the recipe's limits
  std::vector<StageShare> stages{};  ///< of the reconstruction, in the order of their start
  std::optional<Error> error{};      ///< why it failed, was interrupted or cancelled; or did not pass
  std::string model{};               ///< path of the model file, once it exists
  std::string report{};
};

/// Part of the scan exists, so it can only continue with the same settings.
inline bool has_views(const JobInfo& job) { return job.complete > 0 || !job.stored.empty(); }

/// A job that should have started, and why it did not.
struct NotStarted {
  std::string job;
  Error why;
};

}  // namespace scanrig
