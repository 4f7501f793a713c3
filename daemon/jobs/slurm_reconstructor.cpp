#include <fstream>
#include <tuple>
#include <utility>

#include "core/catch_exceptions.h"
#include "core/secrets.h"
#include "daemon/jobs/executors.h"
#include "daemon/jobs/job_files.h"
#include "daemon/jobs/node_run.h"
#include "daemon/jobs/progress_lines.h"
#include "daemon/jobs/slurm_client.h"
#include "daemon/jobs/slurm_submission.h"
#include "daemon/jobs/stoppable_wait.h"

namespace scanrig {
namespace {

using WatchClock = std::chrono::steady_clock;

/// Why a job that has left the cluster gave no result; nothing where its script was killed, as by a node that failed.
std::optional<Error> limit_reached(const std::string& id, const SlurmJob& job, const std::filesystem::path& run,
                                   const SlurmExecutorOptions& options) {
  const auto on = job.nodes.empty() ? "no node" : job.nodes;
  if (job.word == "TIMEOUT" || job.word == "DEADLINE") {
    return Error{ErrorCode::timeout, fmt::format("Slurm's job {} on {} was ended after its {} min; raise timeout_min",
                                                 id, on, options.local.limit.count() / 60)};
  }
  if (job.word == "OUT_OF_MEMORY") {
    return Error{ErrorCode::out_of_range,
                 fmt::format("Slurm's job {} on {} needed more than its {} MiB of memory; raise memory_gib or voxel_mm",
                             id, on, options.local.memory_bytes >> 20)};
  }
  if (job.word == "CANCELLED") {
    return Error{ErrorCode::stopped,
                 fmt::format("Slurm's job {} was cancelled at the cluster; reprocess the scan", id)};
  }
  if (job.exit_code == kNoFolder) {
    return Error{
        ErrorCode::not_found,
        fmt::format("{} does not see {}; share this folder with the nodes or set slurm_stage", on, run.string())};
  }
  return std::nullopt;
}

class SlurmReconstructor final : public Reconstructor {
 public:
  SlurmReconstructor(SlurmExecutorOptions options, const ReconstructionTask& task, std::unique_ptr<Reconstructor> local)
      : options_(std::move(options)),
        folder_(std::filesystem::absolute(task.folder)),
        fixture_(task.fixture),
        changes_(task.changes),
        is_ending_(task.is_ending),
        local_(std::move(local)),
        client_(options_.commands),
        places_(folder_, options_.stage) {}

  /// A job that was cancelled before its turn may have a job of an earlier daemon at the cluster.
  ~SlurmReconstructor() override {
    if (is_finished_ || is_ending_()) return;
    submission_ = read_submission(folder_);
    if (!submission_) return;
    cancel();
    places_.forget(*submission_);
  }
  SlurmReconstructor(const SlurmReconstructor&) = delete;
  SlurmReconstructor& operator=(const SlurmReconstructor&) = delete;

  Result<void> add_view(std::size_t, const RawView&, const ViewRecord&, const Context&) override { return {}; }
  Result<void> finish_pose(std::size_t, const Context&) override { return {}; }

  Result<void> finish(const std::filesystem::path& folder, const Context& context) override {
    is_finished_ = true;
    auto done = work(folder, context);
    if (!done && done.error().code == ErrorCode::stopped && context.stopped()) {
      if (is_ending_()) return done;  // the next daemon continues with the job
      cancel();
    }
    if (submission_) places_.forget(*std::exchange(submission_, std::nullopt));
    return done;
  }

 private:
  enum class Came { model, nothing };

  Result<void> work(const std::filesystem::path& folder, const Context& context) {
    if (auto adopted = adopt(context); !adopted) {
      const bool is_away = adopted.error().code == ErrorCode::timeout;
      return is_away && may_work_here() ? work_here(folder, context) : adopted;
    }
    for (;;) {
      if (!submission_) {
        auto submitted = submit(context);
        if (!submitted && submitted.error().code == ErrorCode::timeout && may_work_here()) {
          return work_here(folder, context);
        }
        if (!submitted) return submitted;
      }
      forget_attempts(folder_);  // the daemon may die now: the work is not in it
      const auto came = follow(context);
      if (!came) places_.fetch_choices(*submission_);
      if (!came) return pass_on(came);
      if (*came == Came::model) return places_.take_model(*submission_, folder);
      if (auto again = count_lost(); !again) return again;
    }
  }

  /// Takes up the job of an earlier daemon. One that was made for other options is cancelled.
  Result<void> adopt(const Context& context) {
    submission_ = read_submission(folder_);
    if (!submission_) return {};
    const bool asks_otherwise = changes_.voxel_mm || !changes_.fusion.empty();
    const bool is_same =
        changes_.voxel_mm == submission_->changes.voxel_mm && changes_.fusion == submission_->changes.fusion;
    if (asks_otherwise && !is_same) {
      std::ignore = client_.cancel(submission_->name(folder_));
      places_.forget(*std::exchange(submission_, std::nullopt));
      return {};
    }
    if (!asks_otherwise) changes_ = submission_->changes;
    if (!submission_->id.empty() || run_end(places_.run(*submission_))) return {};
    const auto found = find(context);
    if (!found) return pass_on(found);
    if (*found || run_end(places_.run(*submission_))) return {};
    lost_ = submission_->lost;
    places_.forget(*std::exchange(submission_, std::nullopt));
    return {};
  }

  /// The recorded job at the cluster by its name; its id is recorded then. Waits for the controller.
  Result<bool> find(const Context& context) {
    const auto give_up = WatchClock::now() + options_.away_limit;
    for (;;) {
      const auto found = client_.find(submission_->name(folder_), context.stop);
      if (found && !*found) return false;
      if (found) {
        submission_->id = **found;
        if (auto written = write_submission(folder_, *submission_); !written) return pass_on(written);
        return true;
      }
      if (found.error().code != ErrorCode::timeout || may_work_here()) return pass_on(found);
      if (auto waited = wait_for_controller(context, give_up, found.error()); !waited) return pass_on(waited);
    }
  }

  Result<void> submit(const Context& context) {
    auto run = random_hexadecimal(8);
    if (!run) return pass_on(run);
    submission_ = SlurmSubmission{.run = *std::move(run), .id = "", .lost = lost_, .changes = changes_};
    if (auto prepared = places_.prepare(*submission_); !prepared) return prepared;
    if (auto written = write_submission(folder_, *submission_); !written) return written;
    const auto script = write_script();
    if (!script) return pass_on(script);
    const auto give_up = WatchClock::now() + options_.away_limit;
    for (;;) {
      context.report("queue", 0.0);
      auto id = client_.submit(submit_options(), *script, context.stop);
      if (id) {
        submission_->id = *std::move(id);
        return write_submission(folder_, *submission_);
      }
      if (id.error().code != ErrorCode::timeout || may_work_here()) return pass_on(id);
      if (auto waited = wait_for_controller(context, give_up, id.error()); !waited) return waited;
      const auto found = find(context);  // it may have been accepted
      if (!found) return pass_on(found);
      if (*found || run_end(places_.run(*submission_))) return {};
    }
  }

  [[nodiscard]] Result<std::filesystem::path> write_script() const {
    std::vector<std::string> words{
        "--voxel-mm",   fmt::format("{}", changes_.voxel_mm.value_or(options_.local.voxel_mm)),
        "--threads",    fmt::format("{}", options_.cores),
        "--memory-gib", fmt::format("{}", static_cast<double>(options_.local.memory_bytes) / (1U << 30))};
    if (fixture_) words.emplace_back("--fixture");
    if (!changes_.fusion.empty()) words.insert(words.end(), {"--fusion", changes_.fusion});
    const auto run = places_.run(*submission_), file = run / "job.sh";
    std::ofstream script(file);
    script << "#!/bin/sh\n"
           << run_function(options_.program, words)
           << fmt::format("run {} {}\n", shell_word(places_.scan_for_node(*submission_).string()),
                          shell_word(run.string()));
    script.close();
    if (!script.good()) return fail(ErrorCode::io, "cannot write {}", file.string());
    return file;
  }

  [[nodiscard]] std::vector<std::string> submit_options() const {
    const auto run = places_.run(*submission_).string();
    std::vector<std::string> options{"--job-name=" + submission_->name(folder_),
                                     "--chdir=/",
                                     "--output=" + run + "/slurm.log",
                                     "--nodes=1",
                                     fmt::format("--cpus-per-task={}", options_.cores),
                                     fmt::format("--mem={}M", options_.local.memory_bytes >> 20),
                                     fmt::format("--time={}", std::max<long>(1, options_.local.limit.count() / 60))};
    if (!options_.partition.empty()) options.push_back("--partition=" + options_.partition);
    options.insert(options.end(), options_.options.begin(), options_.options.end());
    return options;
  }

  Result<void> wait_for_controller(const Context& context, WatchClock::time_point give_up, const Error& why) const {
    if (WatchClock::now() >= give_up) {
      return fail(ErrorCode::timeout, "no Slurm controller within {} min: {}; check slurmctld and the network",
                  options_.away_limit.count() / 60, why.message);
    }
    context.report("no cluster", 0.0);
    if (!wait_or_stop(context.stop, options_.poll)) return fail(ErrorCode::stopped, "stopped by request");
    return {};
  }

  [[nodiscard]] bool may_work_here() const { return options_.fallback == SlurmExecutorOptions::Fallback::local; }

  /// A submission that was accepted after all is cancelled where that is possible; its run has no folder any more.
  Result<void> work_here(const std::filesystem::path& folder, const Context& context) {
    const auto name = submission_->name(folder_);
    places_.forget(*std::exchange(submission_, std::nullopt));
    auto done = local_->finish(folder, context);
    std::ignore = client_.cancel(name);
    return done;
  }

  struct Watch {
    WatchClock::time_point next_look{}, answered = WatchClock::now();
    std::optional<WatchClock::time_point> gone{};  ///< since when the job has left the cluster
    SlurmJob job{};
  };

  /// Follows the recorded job to its end.
  Result<Came> follow(const Context& context) {
    const auto run = places_.run(*submission_);
    RunLines lines(run);
    ProgressLines progress(context);
    Watch watch;
    for (;;) {
      const auto end = run_end(run);
      lines.read([&](std::string_view line) { progress(line); });
      if (end && *end == 0) return Came::model;
      if (end && !was_ended_from_outside(*end)) return tl::unexpected(run_error(run, *end, progress.failure));
      if (auto looked = look(watch, context); !looked) return pass_on(looked);
      if (watch.gone &&
          (end || WatchClock::now() >= *watch.gone + options_.files_limit || watch.job.exit_code == kNoFolder)) {
        if (const auto reached = limit_reached(submission_->id, watch.job, run, options_))
          return tl::unexpected(*reached);
        if (end && watch.job.word == "FAILED") return tl::unexpected(run_error(run, *end, progress.failure));
        return Came::nothing;
      }
      if (!wait_or_stop(context.stop, options_.files_every)) return fail(ErrorCode::stopped, "stopped by request");
    }
  }

  /// Reads the job's state from the controller when it is time for it.
  Result<void> look(Watch& watch, const Context& context) {
    if (submission_->id.empty()) {  // ended before its id was recorded
      watch.gone = watch.gone.value_or(WatchClock::now());
      return {};
    }
    if (watch.gone || WatchClock::now() < watch.next_look) return {};
    const auto job = client_.look(submission_->id, context.stop);
    const auto now = WatchClock::now();
    watch.next_look = now + options_.poll;
    if (!job) {
      if (job.error().code != ErrorCode::timeout) return pass_on(job);
      if (now < watch.answered + options_.away_limit) return {};
      return fail(ErrorCode::timeout, "no Slurm controller within {} min while job {} runs: {}",
                  options_.away_limit.count() / 60, submission_->id, job.error().message);
    }
    watch.answered = now;
    watch.job = *job;
    if (job->state == SlurmJob::State::pending) context.report("queue", 0.0);
    if (job->state == SlurmJob::State::ended || job->state == SlurmJob::State::lost) watch.gone = now;
    return {};
  }

  /// The run's folder goes: what still runs on the lost node has no place to write to.
  Result<void> count_lost() {
    const auto id = submission_->id;
    lost_ = submission_->lost + 1;
    std::ignore = client_.cancel(submission_->name(folder_));
    places_.remove_run(*submission_);
    if (lost_ <= options_.resubmits) {
      submission_.reset();
      return {};
    }
    return fail(ErrorCode::timeout, "the cluster lost the job {} times, at last as job {}; check its nodes with sinfo",
                lost_, id);
  }

  /// Waits until the job has left the cluster.
  void cancel() {
    if (!submission_) return;
    std::ignore = client_.cancel(submission_->name(folder_));
    for (const auto by = WatchClock::now() + options_.files_limit; WatchClock::now() < by;) {
      const auto found = client_.find(submission_->name(folder_), {});
      if (found && !*found) return;
      if (!found) return;  // no controller: a job that starts later has no folder
      wait_or_stop({}, options_.files_every);
    }
  }

  SlurmExecutorOptions options_;
  std::filesystem::path folder_;
  bool fixture_;
  ReconstructionChanges changes_;
  std::function<bool()> is_ending_;
  std::unique_ptr<Reconstructor> local_;
  SlurmClient client_;
  SlurmPlaces places_;
  std::optional<SlurmSubmission> submission_{};
  int lost_ = 0;
  bool is_finished_ = false;  ///< finish() was called
};

}  // namespace

ReconstructorFactory slurm_reconstructor(SlurmExecutorOptions options) {
  auto here = process_reconstructor(options.local);
  return [options = std::move(options),
          here = std::move(here)](const ReconstructionTask& task) -> Result<std::unique_ptr<Reconstructor>> {
    auto local = here(task);
    if (!local) return pass_on(local);
    return std::make_unique<SlurmReconstructor>(options, task, *std::move(local));
  };
}

}  // namespace scanrig
