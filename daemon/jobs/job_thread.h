#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <thread>
#include <variant>

#include "daemon/jobs/job_files.h"
#include "daemon/jobs/job_store.h"
#include "daemon/jobs/reconstruction_thread.h"
#include "daemon/runtime/actor.h"
#include "daemon/station/events.h"

namespace scanrig {

/// Puts jobs and views on disk while the table moves. A view is reported as stored, and handed to the reconstruction,
/// only when it survives a power cut.
class JobThread {
 public:
  /// An entry for the job's own log.
  struct LogLine {
    JournalEntry entry;
    std::chrono::system_clock::time_point when;
  };
  using Task = std::variant<LogLine, action::CheckCalibration, action::CreateJobs, action::StartJob, action::MoveJob,
                            action::RunJobRequest, action::StoreView, action::CheckMovement, action::FinishPose,
                            action::CheckPlacement, action::DropPlacement, action::ResumeJob, action::CloseJob>;
  using ScannedHook = std::function<Result<void>(const std::filesystem::path& job_folder)>;

  /// `on_scanned` (may be empty) is called when all views of a job are on disk, before any report.
  JobThread(Clock& clock, const JobStore& store, ReconstructionThread& reconstruction, ScannedHook on_scanned,
            std::function<void(Event)> post_event);
  /// Does what was posted, then joins.
  ~JobThread();
  JobThread(const JobThread&) = delete;
  JobThread& operator=(const JobThread&) = delete;

  void post(Task task) { inbox_.post(std::move(task)); }
  /// The same for an entry of the log: it goes to the log of the job it names.
  void log(JournalEntry entry) { post(LogLine{std::move(entry), std::chrono::system_clock::now()}); }
  /// Time for which the disk has blocked this thread. From any thread.
  [[nodiscard]] Clock::Duration waiting() const { return busy_timer_.lasts(); }

 private:
  void run();
  void fail_task(const Task& task, const Error& why);
  void handle(const LogLine& line);
  void handle(const action::CheckCalibration& task);
  void handle(const action::CreateJobs& task);
  void handle(const action::StartJob& task);
  void handle(const action::MoveJob& task);
  void handle(const action::RunJobRequest& task);
  void handle(const action::StoreView& task);
  void handle(const action::CheckMovement& task);
  void handle(const action::FinishPose& task);
  void handle(const action::CheckPlacement& task);
  void handle(const action::DropPlacement& task);
  void handle(const action::ResumeJob& task);
  void handle(const action::CloseJob& task);

  [[nodiscard]] Result<JobInfo> read_whole(const std::string& id) const;
  void set_aside(const std::string& id, const Error& why);
  Result<void> begin(const JobInfo& job);
  Result<void> move(const action::MoveJob& task);
  Result<void> add_pose(const JobInfo& job, std::int64_t place);
  Result<JobInfo> without_failed_pose(JobInfo job);
  Result<void> take_pose_back(const JobInfo& job, JobFile order);
  Result<void> cancel(const JobInfo& job);
  Result<void> keep(const event::JobRequested& asked);
  Result<void> finish_pose(const action::FinishPose& task);
  Result<MovementCheck> judge(const TakenView& again);
  Result<void> choose(JobInfo job, const event::JobRequested& asked);
  Result<void> reprocess(JobInfo job, const event::JobRequested& asked);
  [[nodiscard]] bool storing() const { return scan_ && !broken_; }
  void give_up(const std::string& job, const Error& why);
  void tell_known(const std::string& job);
  void answer(RequestId request_id, const Result<void>& done, const std::string& result);

  const JobStore& store_;
  ReconstructionThread& reconstruction_;
  ScannedHook on_scanned_;
  std::function<void(Event)> post_event_;
  Mailbox<Task> inbox_;
  BusyTimer busy_timer_;
  // Only for the thread.
  std::optional<ScanFolder> scan_;  ///< of the active job
  std::optional<Recipe> later_;     ///< its recipe, where the reconstruction starts only after the last view
  bool broken_ = false;             ///< it refused a view: no later view may be stored in it
  std::thread thread_;
};

}  // namespace scanrig
