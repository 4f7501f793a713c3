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
