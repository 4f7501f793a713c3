#include <gmock/gmock.h>

#include <condition_variable>
#include <mutex>
#include <set>

#include "daemon/jobs/job_thread.h"
#include "daemon/station/job_lifecycle.h"
#include "tests/component/daemon/fake_reconstructor.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using What = event::JobRequested::What;

constexpr std::chrono::seconds kAmple{30};

/// Next orders that the station can give for a job.
enum class Step {
  start,
  view,
  check_unmoved,
  check_moved,
  finish_with_model,
  finish_without_model,
  turn_over,
  interrupt,
  fail,
  resume,
  cancel,
  reprocess_with_model,
  reprocess_without_model,
  add_pose
};
using History = std::vector<Step>;

/// Jobs of two poses of one view, some of which are given a third, through the real threads and folders. The test is
/// the control loop.
class JobHistory : public scan_samples::FolderTest, public testing::WithParamInterface<Limits> {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    auto opened = JobStore::open({.root = folder_ / "jobs", .calibration_file = folder_ / "calibration.json"});
    ASSERT_TRUE(opened) << opened.error().message;
    store_.emplace(std::move(*opened));
    const auto post_event = [this](const Event& event) { report(event); };
    reconstruction_.emplace(
        clock_,
        [this](const auto&) -> Result<std::unique_ptr<Reconstructor>> {
          return std::make_unique<fakes::FakeReconstructor>(log_);
        },
        post_event);
    jobs_.emplace(clock_, *store_, *reconstruction_, nullptr, post_event);
  }

  void report(const Event& event) {
    const std::lock_guard guard(mutex_);
    update(table_, event);
    if (const auto* done = std::get_if<event::RequestDone>(&event)) {
      EXPECT_TRUE(done->result) << done->result.error().message;
    }
    ++events_[event.index()];
    changed_.notify_all();
  }
  /// Posts `task` and returns once an event of one of these kinds has come.
  template <class... Kinds>
  void post(JobThread::Task task) {
    std::unique_lock lock(mutex_);
    const auto count = [this] { return (events_[Event(Kinds{}).index()] + ...); };
    const int before = count();
    jobs_->post(std::move(task));
    ASSERT_TRUE(changed_.wait_for(lock, kAmple, [&] { return count() > before; }));
  }

  JobInfo told() {
    const std::lock_guard guard(mutex_);
    return *table_.at(id_);
  }
  void begin_history() {
    id_ = fmt::format("job-{:03}", ++histories_);
    checked_ = moved_ = turned_ = false;
    const Recipe recipe{.poses = 2, .views = 1, .limits = GetParam()};
    post<event::RequestDone>(action::CreateJobs{{id_}, recipe, "", 0, 1});
  }
  std::shared_ptr<const TakenView> taken(int pose, int seed) const {
    return std::make_shared<const TakenView>(
        TakenView{{id_, pose, 0}, {.taken = "2026-11-21T09:30:04Z"}, scan_samples::raw_view(seed)});
  }
  void close_as(JobState state, const Error& why) {
    const action::CloseJob task{id_, state, why};
    {
      const std::lock_guard guard(mutex_);
      close(table_, task);
    }
    post<event::JobClosed>(task);
    wait_for_reconstruction();
  }
  void finish(bool model) {
    {
      const std::lock_guard guard(log_.mutex);
      log_.answer_to_finish = model ? Result<void>() : fail(ErrorCode::degenerate, "nothing seen");
    }
    const int pose = told().complete;
    const bool is_last = pose + 1 == told().recipe.poses;
    const action::FinishPose task{id_, pose, is_last};
    if (is_last) {
      post<event::ModelReady, event::ReconstructionFailed>(task);
    } else {
      post<event::PoseStored>(task);
    }
    checked_ = turned_ = false;
    wait_for_reconstruction();
  }
  /// A failure is reported before its reconstruction has ended.
  void wait_for_reconstruction() {
    const auto deadline = Deadline::after(clock_, kAmple);
    while ((is_final(told().state) || told().complete == told().recipe.poses) && reconstruction_->has(id_)) {
      ASSERT_FALSE(deadline.expired(clock_));
      clock_.sleep_for(std::chrono::milliseconds(1));
    }
  }
  void reprocess(bool model) {
    {
      const std::lock_guard guard(log_.mutex);
      log_.answer_to_finish = model ? Result<void>() : fail(ErrorCode::degenerate, "nothing seen");
    }
    post<event::ModelReady, event::ReconstructionFailed>(
        action::RunJobRequest{{.what = What::reprocess, .job = id_, .request_id = 1}});
    wait_for_reconstruction();
  }
  void take(Step step) {
    const int pose = told().complete;
    switch (step) {
      case Step::start: checked_ = false; return post<event::JobStarted>(action::StartJob{id_});
      case Step::view: return post<event::ViewStored>(action::StoreView{taken(pose, pose)});
      case Step::check_unmoved:
        checked_ = true;
        return post<event::MovementChecked>(action::CheckMovement{taken(pose, pose)});
      case Step::check_moved:
        checked_ = moved_ = true;
        return post<event::MovementChecked>(action::CheckMovement{taken(pose, 7)});
      case Step::finish_with_model: return finish(true);
      case Step::finish_without_model: return finish(false);
      case Step::turn_over: turned_ = true; return jobs_->post(action::ResumeJob{id_});
      case Step::interrupt: return close_as(JobState::interrupted, {ErrorCode::stopped, "Stop was pressed"});
      case Step::fail: return close_as(JobState::failed, {ErrorCode::moved, "something moved"});
      case Step::resume: return post<event::RequestDone>(action::MoveJob{id_, -1, action::MoveJob::How::resumed, 1});
      case Step::add_pose: return post<event::RequestDone>(action::MoveJob{id_, -1, action::MoveJob::How::one_more, 1});
      case Step::cancel:
        return post<event::RequestDone>(action::RunJobRequest{{.what = What::cancel, .job = id_, .request_id = 1}});
      case Step::reprocess_with_model: return reprocess(true);
      case Step::reprocess_without_model: return reprocess(false);
    }
  }

  /// Next steps that the rules of the station allow.
  std::vector<Step> next_steps() {
    const auto job = told();
    const auto views = static_cast<int>(job.stored.size());
    switch (job.state) {
      case JobState::queued: return {Step::start, Step::cancel};
      case JobState::waiting_for_flip:
        return turned_ ? std::vector{Step::view, Step::interrupt} : std::vector{Step::turn_over, Step::interrupt};
      case JobState::scanning:
        if (moved_) return {Step::fail};
        if (views == job.complete) return {Step::view, Step::interrupt};
        if (!checked_) return {Step::check_unmoved, Step::check_moved, Step::interrupt};
        if (job.complete == 0) return {Step::finish_with_model, Step::interrupt};
        return {Step::finish_with_model, Step::finish_without_model, Step::interrupt};
      case JobState::interrupted:
        return is_resumable(job) ? std::vector{Step::resume, Step::cancel} : std::vector{Step::cancel};
      case JobState::done:
      case JobState::failed:
        if (job.complete == 3) return {Step::reprocess_with_model};  // as of two poses
        if (job.complete == 2) return {Step::reprocess_with_model, Step::reprocess_without_model, Step::add_pose};
        return {};
      default: return {};
    }
  }
  std::string key() {
    const auto job = told();
    return fmt::format("{} {} {} {} {} {} {} {}", to_string(job.state), job.complete, job.stored.size(), checked_,
                       moved_, turned_, job.model.empty(), job.error ? job.error->message : "");
  }

  /// Differences between the folder and the reports; the folder has a while to catch up.
  std::string difference() {
    const auto deadline = Deadline::after(clock_, kAmple);
    for (;;) {
      const auto text = difference_now();
      if (text.empty() || deadline.expired(clock_)) return text;
      clock_.sleep_for(std::chrono::milliseconds(2));
    }
  }
  std::string difference_now() {
    const auto reported = told();
    const auto read = store_->read(id_);
    if (!read) return read.error().message;
    const bool active = reported.state == JobState::scanning || reported.state == JobState::waiting_for_flip;
    auto expected = reported;
    if (active) expected.state = JobState::interrupted;  // the process that scanned it has ended
    std::string text;
    const auto expect = [&](const char* what, const auto& is, const auto& should_be) {
      if (is != should_be) text += fmt::format("{}: {} in the folder, {} reported; ", what, is, should_be);
    };
    expect("state", to_string(read->state), to_string(expected.state));
    expect("resumable", is_resumable(*read), is_resumable(expected));
    expect("complete", read->complete, expected.complete);
    expect("poses", read->recipe.poses, expected.recipe.poses);
    expect("views", read->stored.size(), expected.stored.size());
    expect("checks", read->movement_checks.size(), expected.movement_checks.size());
    expect("model", read->model, expected.model);
    expect("report", read->report, expected.report);
    expect("passed", read->passed.value_or(false), expected.passed.value_or(false));
    expect("quarantined", read->quarantined, expected.quarantined);
    if (!active)
      expect("error", read->error ? read->error->message : "", expected.error ? expected.error->message : "");
    return text;
  }

  RealClock clock_;
  std::optional<JobStore> store_;
  fakes::ReconstructionLog log_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::size_t, int> events_;
  JobTable table_;
  std::string id_;
  int histories_ = 0;
  bool checked_ = false, moved_ = false, turned_ = false;
  std::optional<ReconstructionThread> reconstruction_;
  std::optional<JobThread> jobs_;
};

TEST_P(JobHistory, WhatIsReadBackIsWhatWasReported) {
  std::set<std::string> seen;
  std::vector<History> open{{}};
  while (!open.empty()) {
    const auto history = open.back();
    open.pop_back();
    ASSERT_NO_FATAL_FAILURE(begin_history());
    for (const auto step : history) {
      ASSERT_NO_FATAL_FAILURE(take(step));
      ASSERT_EQ(difference(), "");  // what is under way has ended, too
    }
    std::string steps;
    for (const auto step : history) steps += fmt::format(" {}", static_cast<int>(step));
    EXPECT_EQ(difference(), "") << "after the steps" << steps;
    if (!seen.insert(key()).second) continue;
    for (const auto step : next_steps()) {
      open.push_back(history);
      open.back().push_back(step);
    }
  }
  EXPECT_GT(seen.size(), 40u);
  for (const char* const state :
       {"queued", "scanning", "waiting_for_flip", "done", "failed", "interrupted", "cancelled"}) {
    EXPECT_THAT(seen, testing::Contains(testing::StartsWith(state)));
  }
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutLimits, JobHistory,
                         testing::Values(Limits{}, Limits{.min_measured_share = 0.5}));

}  // namespace
}  // namespace scanrig
