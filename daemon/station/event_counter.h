#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/clock.h"
#include "daemon/station/job_lifecycle.h"

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

}  // namespace scanrig
