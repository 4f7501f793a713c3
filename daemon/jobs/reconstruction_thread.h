#pragma once

#include <atomic>
#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <variant>

#include "daemon/jobs/calibrator.h"
#include "daemon/jobs/reconstructor.h"
#include "daemon/rig/acquisition.h"
#include "daemon/runtime/actor.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

/// Makes models, one job after the other, while the rig continues; at low priority, so that acquisition comes first.
/// Work on a job ends with its first error; no exception leaves the thread. A job with all its views
/// is marked on disk before its reconstruction and until that ends. A mark found at the next start means that the
/// daemon died in it.
class ReconstructionThread {
 public:
  ReconstructionThread(Clock& clock, ReconstructorFactory factory, std::function<void(Event)> post_event,
                       CalibratorFactory calibrator = {});
  /// As stop(), then joins.
  ~ReconstructionThread();
  ReconstructionThread(const ReconstructionThread&) = delete;
  ReconstructionThread& operator=(const ReconstructionThread&) = delete;

  /// Starts or continues a scan: first takes what its folder holds now, then later views as they come.
  void begin(std::string job, ScanFolder scan, Recipe recipe);
  void add_view(std::shared_ptr<const TakenView> view);
  void finish_pose(std::string job, int pose) { inbox_.post(FinishPose{std::move(job), pose}); }
  /// Reports PlacementChecked once the views before it were examined.
  void check_placement(std::string job, int pose) { inbox_.post(CheckPlacement{std::move(job), pose}); }
  void drop_pose(std::string job, int pose) { inbox_.post(DropPose{std::move(job), pose}); }
  void finish(std::string job) { inbox_.post(Finish{std::move(job)}); }
  void abandon(std::string job) { inbox_.post(Abandon{std::move(job)}); }
  /// Reconstructs a whole scan, from its folder, when no scan is being followed.
  void rebuild(std::string job, std::filesystem::path folder, Recipe recipe, ReconstructionChanges changes);
  /// Ends the work on this job, started or waiting, soon. Nothing more is reported of it and its folder is left alone,
  /// but for a finished model. False when there was no work: then it has ended, and that was reported.
  bool cancel(const std::string& job);
  /// Whether work on this job is started or waiting, and not cancelled.
  bool has(const std::string& job);
  /// Prepares a planned end of the daemon. Requests the running stage to stop, removes the mark before a caller stops
  /// waiting for that stage, and drops the rest.
  void stop();

 private:
  struct Begin {
    std::string job;
    std::filesystem::path folder;
    Recipe recipe;
    ReconstructionChanges changes;
    std::stop_source stop;
    std::optional<ScanFolder> scan{};  ///< as it was at the request; empty: as it is when its turn comes
  };
  struct Rebuild {
    Begin begin;
  };
  struct AddView {
    ViewId id;
    std::shared_ptr<const TakenView> view;  ///< null: read from the disk when its turn comes
  };
  struct FinishPose {
    std::string job;
    int pose;
  };
  struct CheckPlacement {
    std::string job;
    int pose;
  };
  struct DropPose {
    std::string job;
    int pose;
  };
  struct Prepare {
    std::string job;
  };
  struct Finish {
    std::string job;
  };
  struct Abandon {
    std::string job;
  };
  using Message = std::variant<Begin, Rebuild, AddView, FinishPose, CheckPlacement, DropPose, Prepare, Finish, Abandon>;

  struct Current {
    std::string job;
    std::filesystem::path folder;
    Recipe recipe;
    std::stop_source stop;
    std::unique_ptr<Reconstructor> reconstructor{};
    bool quarantined = false;  ///< the scan continues without a model
    int views_done = 0;
    int poses_closed = 0;
    std::vector<std::string> live{};  ///< names of the meshes that are shown
    bool has_suggestions = false;     ///< rests for the next pose
    std::optional<Error> error{};
  };

  void run();
  template <class SomeMessage>
  void perform(const SomeMessage& message);
  void handle(const Begin& message);
  void handle(const Rebuild& message);
  void handle(const AddView& message);
  void handle(const FinishPose& message);
  void handle(const CheckPlacement& message);
  void handle(const DropPose& message);
  void handle(const Prepare& message);
  void handle(const Finish& message);
  void handle(const Abandon& message);

  Begin enlist(std::string job, std::filesystem::path folder, Recipe recipe, ReconstructionChanges changes);
  bool dismiss(const std::stop_source& stop);
  bool works_on(const std::string& job) const;
  Result<void> mark();
  void unmark();
  Result<void> start(const Begin& message, const ScanFolder& scan);
  Result<std::unique_ptr<Reconstructor>> make_reconstructor(const Begin& message, const ScanFolder& scan);
  Result<void> catch_up(const ScanFolder& scan);
  Result<void> add(int pose, const RawView& raw, const ViewRecord& record);
  Result<void> add_stored(const ScanFolder& scan, std::size_t pose, std::size_t view);
  Result<void> close_when_whole(int pose, int view);
  Result<void> close_pose(int pose);
  void show(std::string name, const std::string& glb, bool replaces);
  void suggest(int pose);
  void hide();
  void check(const Result<void>& done);
  Result<event::ModelReady> make_model();
  void end();
  Context context(std::function<void(std::string_view, double)> progress) const {
    return {current_->stop.get_token(), std::move(progress)};
  }
  void tell_progress(std::string stage, double fraction);

  ReconstructorFactory factory_;
  CalibratorFactory calibrator_;
  std::function<void(Event)> post_event_;
  Mailbox<Message> inbox_;
  struct Run {
    std::string job;
    std::stop_source stop;
  };
  std::mutex mutex_;
  std::list<Run> runs_;                          ///< requested and not ended; under mutex_
  std::optional<std::filesystem::path> marked_;  ///< the folder being reconstructed; under mutex_
  std::atomic<bool> ending_ = false;
  std::atomic<int> views_waiting_ = 0;  ///< in the inbox, with their images
  // Only for the thread.
  std::optional<Current> current_;
  std::deque<Begin> rebuilds_;
  std::string told_stage_;
  double told_fraction_ = 0.0;
  std::thread thread_;
};

}  // namespace scanrig
