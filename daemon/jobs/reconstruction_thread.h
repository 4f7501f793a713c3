#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <variant>

#include "daemon/jobs/reconstructor.h"
#include "daemon/mailbox.h"
#include "daemon/rig/taken_view.h"

namespace scanrig {

/// Makes models, one job after the other, while the rig goes on; at nice +10, so that acquisition comes first.
/// Work on a job ends with its first error.
class ReconstructionThread {
 public:
  ReconstructionThread(Clock& clock, ReconstructorFactory factory, int poses, int views,
                       std::function<void(Event)> tell);
  /// Asks the running stage to stop, drops the rest and joins.
  ~ReconstructionThread();
  ReconstructionThread(const ReconstructionThread&) = delete;
  ReconstructionThread& operator=(const ReconstructionThread&) = delete;

  void begin(std::string job, std::filesystem::path folder) { inbox_.post(Begin{std::move(job), std::move(folder)}); }
  void add_view(std::shared_ptr<const TakenView> view) { inbox_.post(AddView{std::move(view)}); }
  void finish_pose(std::string job, int pose) { inbox_.post(FinishPose{std::move(job), pose}); }
  void finish(std::string job) { inbox_.post(Finish{std::move(job)}); }
  void abandon(std::string job) { inbox_.post(Abandon{std::move(job)}); }

 private:
  struct Begin {
    std::string job;
    std::filesystem::path folder;
  };
  struct AddView {
    std::shared_ptr<const TakenView> view;
  };
  struct FinishPose {
    std::string job;
    int pose;
  };
  struct Finish {
    std::string job;
  };
  struct Abandon {
    std::string job;
  };
  using Message = std::variant<Begin, AddView, FinishPose, Finish, Abandon>;

  struct Current {
    std::string job;
    std::filesystem::path folder;
    std::unique_ptr<Reconstructor> reconstructor{};
    int views_done = 0;
    std::optional<Error> error{};
  };

  void run();
  void handle(const Begin& message);
  void handle(const AddView& message);
  void handle(const FinishPose& message);
  void handle(const Finish& message);
  void handle(const Abandon& message);

  bool works_on(const std::string& job) const { return current_ && current_->job == job && !current_->error; }
  void check(const Result<void>& done);
  Result<void> make_model();
  Context context(std::function<void(std::string_view, double)> progress) const {
    return {stop_.get_token(), progress};
  }
  void tell_progress(std::string stage, double fraction);

  ReconstructorFactory factory_;
  int poses_;
  int views_;
  std::function<void(Event)> tell_;
  Mailbox<Message> inbox_;
  std::stop_source stop_;
  // Of the thread only.
  std::optional<Current> current_;
  std::string told_stage_;
  double told_fraction_ = 0.0;
  std::thread thread_;
};

}  // namespace scanrig
