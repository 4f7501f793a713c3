#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/station/event_counter.h"
#include "daemon/station/job_lifecycle.h"
#include "daemon/station/states.h"

namespace scanrig {

/// Whether the table is confirmed to be stopped.
enum class Standstill {
  confirmed,
  pending,  ///< stop was sent, the drive has not confirmed yet
  moving,   ///< by intention
  unknown,  ///< the drive does not respond, or has not been reached yet
};

/// The state of the whole rig at one moment. Immutable once published.
struct Snapshot {
  std::uint64_t revision = 0;
  MachineState machine = MachineState::preoperational;
  Activity activity = Activity::none;
  std::string cause{};
  std::string sentence{};
  std::string next_action{};
  bool may_be_moving = false;  ///< the last stop was not confirmed
  std::string fault_device{};  ///< in Error: the failed device; empty: none, as of an e-stop
  PanelInputs inputs{};
  PanelOutputs outputs{};
  std::vector<DeviceHealth> devices{};         ///< as of the last check
  std::optional<Error> calibration_problem{};  ///< why the calibration refuses the next scan
  std::string job{};                           ///< the active one; empty: none
  std::optional<NotStarted> not_started{};     ///< by the last Start; until the next one
  std::vector<std::string> queue{};            ///< ids of the jobs to come, the next one first
  JobTable jobs{};
  Counters counters{};
};

Standstill standstill(const Snapshot& snapshot);
std::string_view to_string(Standstill standstill);  ///< "confirmed"

/// The latest snapshot, from one writer to any number of readers.
class Published {
 public:
  void set(std::shared_ptr<const Snapshot> snapshot) {
    const std::lock_guard guard(mutex_);
    snapshot_.swap(snapshot);
  }
  [[nodiscard]] std::shared_ptr<const Snapshot> get() const {
    const std::lock_guard guard(mutex_);
    return snapshot_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const Snapshot> snapshot_ = std::make_shared<Snapshot>();
};

}  // namespace scanrig
