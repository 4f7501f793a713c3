// A whole daemon over simulated devices, on a virtual clock, with its files in a real folder: the program that the kill
// test kills and restarts.
//   station_one_job scan FOLDER      one two-pose job from Reset to the model; acknowledged views go to FOLDER/acks
//   station_one_job recover FOLDER   restarts, brings every job it finds to its end, checks that no acknowledged
//                                    view is lost; prints the results, exits 1 when a check fails
// With $ONE_JOB_CRASH set the reconstruction ends in a segmentation fault. With $ONE_JOB_AGAIN set the model of a
// failed job is requested again, once.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "core/virtual_clock.h"
#include "daemon/service/run_daemon.h"
#include "pipeline/model_io/model_files.h"
#include "tests/component/daemon/fake_rig.h"
#include "tests/unit/pipeline/storage/sample_files.h"

namespace {

using namespace scanrig;
namespace fs = std::filesystem;

/// Writes real model files of one triangle.
class TriangleMaker final : public Reconstructor {
 public:
  Result<void> add_view(std::size_t, const RawView&, const ViewRecord&, const Context&) override { return {}; }
  Result<void> finish_pose(std::size_t, const Context&) override { return {}; }
  Result<void> finish(const fs::path& folder, const Context&) override {
    if (std::getenv("ONE_JOB_CRASH")) {
      std::signal(SIGSEGV, SIG_DFL);  // a sanitizer would report it
      std::raise(SIGSEGV);
    }
    TexturedMesh triangle;
    triangle.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.mesh.faces = {{0, 1, 2}};
    const auto written = write_model_files(triangle, "{}\n", folder);
    return written ? Result<void>{} : pass_on(written);
  }
};

/// Output of the station: "JOB POSE VIEW", a line for each view, as soon as it is published.
class Acknowledged {
 public:
  explicit Acknowledged(const fs::path& file) : fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644)) {}
  ~Acknowledged() { ::close(fd_); }
  Acknowledged(const Acknowledged&) = delete;
  Acknowledged& operator=(const Acknowledged&) = delete;

  void note(const Snapshot& snapshot) {
    for (const auto& [id, job] : snapshot.jobs) {
      for (const auto& view : job->stored) {
        const auto line = fmt::format("{} {} {}\n", id, view.pose, view.view);
        if (noted_.insert(line).second && ::write(fd_, line.data(), line.size()) < 0) std::abort();
      }
    }
  }

 private:
  int fd_;
  std::set<std::string> noted_;
};

/// The operator: watches the lamps, presses the buttons that they request, until no job is left.
class Shift {
 public:
  explicit Shift(const fs::path& folder) : folder_(folder), acknowledged_(folder / "acks") {
    options_.jobs = {.root = folder / "jobs", .calibration_file = folder / "calibration.json"};
    options_.recipes["default"].views = 3;
    options_.api.socket = folder / "api.sock";
    options_.reconstructor = [](const ReconstructionTask&) { return std::make_unique<TriangleMaker>(); };
    options_.published = [this](const auto& snapshot) { acknowledged_.note(*snapshot); };
    options_.on_loop = [this](ControlLoop& loop) { loop_ = &loop; };
  }

  /// `resume`: unfinished jobs are brought to their end; otherwise a new job is made.
  Result<void> work(bool resume) {
    std::stop_source stop;
    Result<Ended> ended;
    std::optional<Clock::Busy> until_it_runs(clock_);
    std::thread daemon([&] { ended = run_daemon(rig_.devices(), options_, clock_, stop.get_token()); });
    rig_.panel.wait_attached();
    until_it_runs.reset();
    const bool done = resume ? finish_all() : scan_one();
    stop.request_stop();
    daemon.join();
    if (ended && !done) return fail(ErrorCode::timeout, "the job did not come to its end: {}", said_);
    return ended ? Result<void>() : pass_on(ended);
  }

 private:
  bool wait(const std::function<bool(const PanelOutputs&)>& lamps) {
    const bool seen = rig_.panel.wait_for_lamps(lamps);
    if (!seen) said_ = loop_->snapshot()->cause + " " + loop_->snapshot()->sentence;
    return seen;
  }
  bool get_ready() {
    if (!wait([](const auto& l) { return l.amber && !l.busy && !l.start_lamp; })) return false;
    rig_.panel.press(&PanelInputs::reset);
    return wait([](const auto& l) { return l.start_lamp; });
  }
  /// Presses Start, and again after each flip, until the rig is ready again.
  bool start() {
    do {
      rig_.panel.press(&PanelInputs::start);
      if (!wait([](const auto& l) { return !l.start_lamp; })) return false;
      if (!wait([](const auto& l) { return l.start_lamp || ((l.red || l.amber) && !l.busy); })) return false;
      said_ = loop_->snapshot()->cause;
      const bool interrupted = said_.find("is interrupted") != std::string::npos;
      if (interrupted || loop_->snapshot()->machine == MachineState::error) return false;
    } while (loop_->snapshot()->activity == Activity::waiting_for_flip);
    return true;
  }
  bool wait_reconstructed() {
    const auto busy = [](const auto& entry) { return entry.second->state == JobState::reconstructing; };
    for (int second = 0; second < 3600; ++second) {
      if (std::ranges::none_of(loop_->snapshot()->jobs, busy)) return true;
      clock_.sleep_for(std::chrono::seconds(1));
    }
    said_ = "a reconstruction never ended";
    return false;
  }
  bool scan_one() { return get_ready() && start() && wait_reconstructed(); }

  bool finish_all() {
    if (!get_ready()) return false;
    const auto found = loop_->snapshot();
    for (const auto& [id, job] : found->jobs) {
      if (job->state == JobState::interrupted) ask(is_resumable(*job) ? What::resume : What::cancel, id);
    }
    while (!loop_->snapshot()->queue.empty()) {
      if (!start()) return false;
    }
    if (!wait_reconstructed()) return false;
    if (!std::getenv("ONE_JOB_AGAIN")) return true;
    for (const auto& [id, job] : loop_->snapshot()->jobs) {
      if (job->state == JobState::failed) ask(What::reprocess, id);
    }
    return wait_reconstructed();
  }

  using What = event::JobRequested::What;
  void ask(What what, const std::string& job) {
    std::mutex mutex;
    std::condition_variable changed;
    bool answered = false;
    loop_->ask(event::JobRequested{.what = what, .job = job}, [&](const Result<std::string>& result) {
      const std::lock_guard guard(mutex);
      if (!result) fmt::print("refused: {}\n", result.error().message);
      answered = true;
      clock_.notify_all(changed);
    });
    const Clock::Actor actor(clock_);
    std::unique_lock lock(mutex);
    clock_.wait_until(lock, changed, clock_.now() + std::chrono::hours(1), [&] { return answered; });
  }

  fs::path folder_;
  VirtualClock clock_;
  fakes::FakeRig rig_{clock_};
  Acknowledged acknowledged_;
  DaemonOptions options_;
  ControlLoop* loop_ = nullptr;
  std::string said_;
};

/// Faults of the folders after every job has come to its end. A job with an acknowledged view must be done, not only
/// ended.
std::vector<std::string> faults(const fs::path& folder) {
  std::vector<std::string> found;
  std::set<std::string> begun;
  auto store = JobStore::open({.root = folder / "jobs", .calibration_file = folder / "calibration.json"});
  const auto jobs = store ? store->recover() : Result<JobTable>(pass_on(store));
  if (!jobs) return {jobs.error().message};
  std::ifstream acks(folder / "acks");
  std::string id;
  for (int pose = 0, view = 0; acks >> id >> pose >> view;) {
    begun.insert(id);
    const auto scan = ScanFolder::open(store->folder(id));
    const auto raw = scan ? scan->load_raw(static_cast<std::size_t>(pose), static_cast<std::size_t>(view))
                          : Result<RawView>(pass_on(scan));
    if (!raw) found.push_back(fmt::format("lost: pose {} view {} of {}: {}", pose + 1, view, id, raw.error().message));
  }
  for (const auto& [name, job] : *jobs) {
    const bool ended = job->state == JobState::cancelled && !begun.contains(name);
    if (job->state == JobState::done || ended) continue;
    found.push_back(fmt::format("{} ended {}: {}", name, to_string(job->state), job->error ? job->error->message : ""));
  }
  return found;
}

int recover(const fs::path& folder) {
  // Views that the killed daemon had acknowledged must exist before anything else happens.
  const auto done = Shift(folder).work(true);
  if (!done) fmt::print("{}\n", done.error().message);
  const auto found = faults(folder);
  for (const auto& fault : found) fmt::print("{}\n", fault);
  return done && found.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const fs::path folder = argv[2];
  if (argv[1] == std::string_view("recover")) return recover(folder);
  scan_samples::write_text(folder / "calibration.json", scan_samples::calibration_json());
  const auto done = Shift(folder).work(false);
  if (!done) fmt::print("{}\n", done.error().message);
  return done ? 0 : 1;
}
