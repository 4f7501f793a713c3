#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/station/recipe.h"
#include "daemon/station/states.h"

namespace scanrig {

struct StoredView {
  int pose = 0;
  int view = 0;
  double measured_deg = 0.0;
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
  double commanded_deg = 0.0;
  double settling_ms = 0.0;  ///< from in-position to still
};

struct StageShare {
  std::string name;
  double fraction = 0.0;
};

/// What view 0, taken again, says about the views since: a movement check, or the check before a job is resumed.
struct MovementCheck {
  int pose = 0;
  double shift_px = 0.0;                ///< of what is seen, the larger of both cameras
  double changed = 0.0;                 ///< share of what is seen that looks different, 0 to 1
  bool unmoved = true;                  ///< object, table and cameras are where they were
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
};

/// What is known of one job.
struct JobInfo {
  std::string id{};
  std::string folder{};
  JobState state = JobState::queued;
  Recipe recipe{};
  std::string part{};      ///< of the order: barcode text or what the operator typed; may be empty
  std::int64_t place = 0;  ///< in the queue: the smallest comes first
  int complete = 0;        ///< poses whose views are all there
  std::vector<StoredView> stored{};
  std::vector<std::string> config_sha256{};  ///< of each configuration they were taken under
  std::vector<MovementCheck> movement_checks{};
  bool quarantined = false;          ///< two daemons died over its reconstruction: only `reprocess` tries again
  bool exported = false;             ///< somebody has what he needs of it
  std::optional<bool> passed{};      ///< done: whether the model is within the recipe's limits
  std::vector<StageShare> stages{};  ///< of the reconstruction, in the order they began
  std::optional<Error> error{};      ///< why it failed, was interrupted or cancelled; or did not pass
  std::string model{};               ///< path of the model file, once it is there
  std::string report{};
};

/// Something of the scan is there, so it can only go on as it was begun.
inline bool has_views(const JobInfo& job) { return job.complete > 0 || !job.stored.empty(); }

/// A job that was to be begun, and why it was not.
struct NotStarted {
  std::string job;
  Error why;
};

}  // namespace scanrig
