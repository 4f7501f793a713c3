#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "daemon/station/job_lifecycle.h"
#include "daemon/station/states.h"

namespace scanrig {

/// Counts since the daemon started. They only grow.
struct Counters {
  std::uint64_t views_stored = 0;
  std::uint64_t retakes = 0;
  std::uint64_t faults = 0;                           ///< of rig, panel and disk, e-stops included
  std::uint64_t deadlines_missed = 0;                 ///< faults that were a deadline passed
  std::map<std::string, std::uint64_t> jobs_ended{};  ///< by state
  std::map<std::string, double> stage_seconds{};      ///< of reconstruction stages, by name
};

/// Counts the control loop's events. Threads: one user.
class EventCounter {
 public:
  void see(const Event& event, Clock::TimePoint now);
  void see(const JobEnd& end);
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void fault(const Error& error);

  Counters counters_;
  std::map<std::pair<std::string, std::string>, Clock::TimePoint> running_;  // since when, by job and stage
};

/// A placement of the calibration board that the next Start begins.
struct AwaitedPlacement {
  std::string job;
  int placement = 0;  ///< from 0
  std::optional<double> table_deg{};
  bool operator==(const AwaitedPlacement&) const = default;
};

/// How urgent the rig's state is to a person, and one word for it.
enum class Tone { idle, ready, working, act, fault };
std::string_view to_string(Tone tone);
struct Headline {
  Tone tone = Tone::idle;
  std::string word = "WAIT";  ///< "READY"; "5/8": the view that is being taken
};

/// Whether Start, Reset and setup would be obeyed, pressed remotely now. Stop always is.
struct RemoteActions {
  std::optional<Error> start_refused{}, reset_refused{};  ///< why; nothing: it would be obeyed
  std::optional<Error> setup_refused{};                   ///< why the devices would not be lent to setup
  std::string start_offer{};                              ///< start_offer() in transition.h
};

/// The last order to the rig that was obeyed, so that others who look at it see why its state has changed.
struct LastOrder {
  std::string what{};  ///< "start", "stop", "reset", "maintenance on", "home", "jog", ...
  std::string who{};   ///< "panel", the name of a token, a user of this machine, or an address
  std::chrono::system_clock::time_point when{};
};

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
  Headline headline{};
  RemoteActions actions{};
  bool may_be_moving = false;  ///< the last stop was not confirmed
  std::string fault_device{};  ///< in Error: the failed device; empty: none, as of an e-stop
  PanelInputs inputs{};
  PanelOutputs outputs{};
  std::vector<DeviceHealth> devices{};         ///< as of the last check
  std::optional<Error> calibration_problem{};  ///< why the calibration refuses the next scan
  std::string calibration_reminder{};          ///< that it is old, as a sentence; empty: it is not
  std::optional<AwaitedPlacement> awaited_placement{};
  std::optional<LastOrder> last_order{};    ///< nothing since the service started
  std::string job{};                        ///< the active one; empty: none
  std::optional<NotStarted> not_started{};  ///< by the last Start; until the next one
  std::vector<std::string> queue{};         ///< ids of the jobs to come, the next one first
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
