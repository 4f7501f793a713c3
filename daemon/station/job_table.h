#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/station/events.h"

namespace scanrig {

struct StoredView {
  int pose = 0;
  int view = 0;
  double measured_deg = 0.0;
  int redone = 0;  ///< exposures that were lost and taken again
  double commanded_deg = 0.0;
  double settling_ms = 0.0;  ///< from in-position to still
};

struct StageShare {
  std::string name;
  double fraction = 0.0;
};

/// What is known of one job.
struct JobInfo {
  std::string id{};
  std::string folder{};
  JobState state = JobState::queued;
  int poses = 0;
  int views = 0;  ///< a pose
  std::vector<StoredView> stored{};
  std::vector<StageShare> stages{};  ///< of the reconstruction, in the order they began
  std::optional<Error> error{};      ///< why it failed, was interrupted or cancelled
  std::string model{};               ///< path of the model file, once it is there
  std::string report{};
};

/// All jobs by id, oldest first. Entries are immutable: a changed job is a new entry, so that copies are cheap.
using JobTable = std::map<std::string, std::shared_ptr<const JobInfo>>;

/// The table after `event`. Jobs the table does not know are ignored, except in JobCreated.
void update(JobTable& table, const Event& event, int poses, int views);

}  // namespace scanrig
