#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <thread>
#include <variant>

#include "daemon/jobs/bundle.h"
#include "daemon/jobs/job_store.h"
#include "daemon/jobs/retention.h"
#include "daemon/runtime/actor.h"
#include "daemon/station/events.h"

namespace scanrig {

/// Longer work on ended jobs only: deleting, bundling, retention; at low priority.
class HousekeepingThread {
 public:
  /// `jobs`: the station's present list; called from this thread. A folder alone does not show who works in it.
  HousekeepingThread(Clock& clock, const JobStore& store, RetentionOptions retention, std::function<JobTable()> jobs,
                     std::function<void(Event)> post_event, BundleOptions bundle = {});
  /// Stops a bundle that is being packed, drops the rest and joins.
  ~HousekeepingThread();
  HousekeepingThread(const HousekeepingThread&) = delete;
  HousekeepingThread& operator=(const HousekeepingThread&) = delete;

  /// Takes `remove` or `bundle`.
  void post(event::JobRequested asked) { inbox_.post(std::move(asked)); }
  /// Starts a retention sweep.
  void sweep() { inbox_.post(Sweep{}); }

 private:
  struct Sweep {};

  void run();
  void handle(const event::JobRequested& asked);
  void handle(const Sweep& sweep);
  Result<std::string> keep(const event::JobRequested& asked);
  Result<void> sweep_now();
  [[nodiscard]] std::vector<KeptJob> ended_jobs();
  Result<void> remove(const std::string& job);
  [[nodiscard]] std::optional<JobState> state_of(const std::string& job) const;

  const JobStore& store_;
  RetentionOptions retention_;
  std::function<JobTable()> jobs_;
  std::function<void(Event)> post_event_;
  BundleOptions bundle_;
  std::optional<RetentionLedger> ledger_;  ///< set once it was read
  Mailbox<std::variant<event::JobRequested, Sweep>> inbox_;
  std::stop_source stop_;
  std::thread thread_;
};

}  // namespace scanrig
