#include <algorithm>

#include "daemon/station/step_builder.h"

namespace scanrig {
namespace {

using Queue = std::vector<std::shared_ptr<const JobInfo>>;
using What = event::JobRequested::What;

constexpr int kMaxRepeats = 100;
constexpr std::size_t kMaxPartLength = 200;
constexpr auto kTurnedOver = "The automation reports that the part was turned over.";

Queue::iterator find(Queue& queue, const std::string& job) {
  return std::ranges::find_if(queue, [&](const auto& queued) { return queued->id == job; });
}

void leave_queue(StationState& s, const std::string& job) {
  const auto found = find(s.queue, job);
  if (found != s.queue.end()) s.queue.erase(found);
}

std::int64_t last_place(const StationState& s) { return s.queue.empty() ? 0 : s.queue.back()->place; }
std::int64_t first_place(const StationState& s) { return s.queue.empty() ? 0 : s.queue.front()->place; }

bool goes_on_by_itself(const StationState& s) { return !s.queue.empty() && s.queue.front()->recipe.start_on_part; }

/// A part is awaited only while a job exists for it.
void look_at_queue(StepBuilder& m) {
  auto& s = m.s();
  if (s.activity != Activity::waiting_for_part) return;
  if (s.failures >= kFailuresThatStop) {
    m.enter(MachineState::ready, fmt::format("{} jobs in a row failed: the queue has stopped.", s.failures));
  } else if (!goes_on_by_itself(s)) {
    m.enter(MachineState::ready, s.cause);
  }
}

/// Goes before all other jobs: their scans are to have the new calibration.
void take_calibration(StepBuilder& m, const event::JobsOrdered& asked) {
  const auto& s = m.s();
  if (!m.rules().calibration) return m.refuse(ErrorCode::unsupported, "This service cannot solve a calibration.");
  const auto& recipe = asked.order.kind == RecipeKind::check ? check_recipe() : *m.rules().calibration;
  const auto queued = std::ranges::find_if(s.queue, [](const auto& job) { return job->recipe.is_calibration(); });
  const bool active = s.job && s.job->recipe.is_calibration();
  if (active || queued != s.queue.end()) {
    return m.refuse(ErrorCode::busy, "Calibration {} is {}: finish it, or abort it first.",
                    active ? s.job->id : (*queued)->id, active ? "active" : "queued");
  }
  m.act(action::CreateJobs{{asked.new_ids.front()}, recipe, "", first_place(s) - 1, asked.request_id});
}

}  // namespace

void take_order(StepBuilder& m, const event::JobsOrdered& asked) {
  if (m.s().shutting_down) return m.refuse(ErrorCode::refused, "The service is shutting down.");
  if (!m.require_disk()) return;
  if (asked.order.kind != RecipeKind::scan) return take_calibration(m, asked);
  const auto recipe = m.rules().recipes.find(asked.order.recipe);
  if (recipe == m.rules().recipes.end()) {
    return m.refuse(ErrorCode::not_found, "There is no recipe \"{}\". Use one of rig.toml.", asked.order.recipe);
  }
  if (asked.order.repeat < 1 || asked.order.repeat > kMaxRepeats) {
    return m.refuse(ErrorCode::invalid_input, "repeat is {}, but must be 1 to {}.", asked.order.repeat, kMaxRepeats);
  }
  if (asked.order.part.size() > kMaxPartLength) {
    return m.refuse(ErrorCode::invalid_input, "The part id is longer than {} bytes.", kMaxPartLength);
  }
  m.act(action::CreateJobs{asked.new_ids, recipe->second, asked.order.part, last_place(m.s()) + 1, asked.request_id});
}

void ask_job(StepBuilder& m, const event::JobRequested& asked) {
  auto& s = m.s();
  if (s.shutting_down) return m.refuse(ErrorCode::refused, "The service is shutting down.");
  if (!m.require_disk()) return;
  if (m.is_active(asked.job)) {
    return m.refuse(ErrorCode::busy, "Job {} is active: wait or press Stop.", asked.job);
  }
  const bool queued = find(s.queue, asked.job) != s.queue.end();
  const bool goes_first = asked.what == What::to_front || asked.what == What::resume || asked.what == What::add_pose;
  const bool for_waiting = asked.what == What::to_front || asked.what == What::cancel;
  if (asked.what == What::to_front && !queued) {
    return m.refuse(ErrorCode::refused, "Job {} is not queued.", asked.job);
  }
  if (queued && !for_waiting) return m.refuse(ErrorCode::refused, "Job {} is queued: cancel it first.", asked.job);
  if (goes_first) {
    using How = action::MoveJob::How;
    const How how = asked.what == What::resume     ? How::resumed
                    : asked.what == What::add_pose ? How::one_more
                                                   : How::queued;
    return m.act(action::MoveJob{asked.job, first_place(s) - 1, how, asked.request_id});
  }
  m.act(action::RunJobRequest{asked});
}

void job_updated(StepBuilder& m, const std::shared_ptr<const JobInfo>& info) {
  auto& s = m.s();
  if (m.is_active(info->id)) return;  // a new job that is already active
  s.unjudged.erase(info->id);         // cancelled
  leave_queue(s, info->id);
  if (info->state != JobState::queued) return look_at_queue(m);
  const auto behind =
      std::ranges::upper_bound(s.queue, info->place, {}, [](const auto& queued) { return queued->place; });
  s.queue.insert(behind, info);
  if (s.queue.front() == info) m.act(action::CheckCalibration{calibrated_job(s)});
}

void job_removed(StepBuilder& m, const std::string& job) {
  m.s().unjudged.erase(job);
  leave_queue(m.s(), job);
  look_at_queue(m);
}

void start_next_job(StepBuilder& m, const std::string& new_job_id, std::string cause) {
  auto& s = m.s();
  s.not_started.reset();
  if (s.queue.empty()) {
    s.job = ActiveJob{.id = new_job_id, .recipe = m.rules().recipes.at("default")};
    m.act(action::CreateJobs{{new_job_id}, s.job->recipe, "", 0, 0});
  } else {
    const auto& head = *s.queue.front();
    s.job = ActiveJob{.id = head.id, .recipe = head.recipe, .part = head.part};
    s.queue.erase(s.queue.begin());
  }
  s.last_started_job = s.job->id;
  if (!s.job->recipe.is_calibration()) s.unjudged.insert(s.job->id);
  s.machine = s.job->recipe.start_on_part ? MachineState::continuous_execution : MachineState::single_execution;
  s.cause = std::move(cause);
  m.act(action::StartJob{s.job->id});
  m.warn();
}

void job_not_started(StepBuilder& m, const event::JobNotStarted& e) {
  auto& not_started = m.s().not_started;
  if (!not_started || not_started->job != e.job) not_started = {e.job, e.why};  // the first reason counts
  if (!m.is_active(e.job)) return;
  m.s().job.reset();
  m.s().disk_trouble = e.why.code == ErrorCode::io;
  if (m.s().activity != Activity::warning && m.s().activity != Activity::scanning) return;  // a fault came first
  m.enter(MachineState::ready, fmt::format("Job {} did not start: {}.", e.job, e.why.message));
}

/// One damaged folder does not stop the automation. The part on the table is meant for this job. The next job starts
/// with it only if it was ordered with the same part text, and otherwise waits for its own.
void job_unreadable(StepBuilder& m, const event::JobUnreadable& e) {
  if (!m.is_active(e.job)) return;
  auto& s = m.s();
  const auto job = *std::exchange(s.job, std::nullopt);
  count_result(m, job.id, false);
  if (s.activity != Activity::warning && s.activity != Activity::scanning) return;  // a fault came first
  auto cause = fmt::format("Job {} failed, its folder is damaged: {}.", e.job, e.why.message);
  const bool same = !s.queue.empty() && s.queue.front()->stored.empty() && s.queue.front()->part == job.part &&
                    s.queue.front()->recipe == job.recipe;
  if (same && s.failures < kFailuresThatStop) return start_next_job(m, {}, std::move(cause));
  release_rig(m, std::move(cause));
}

void release_rig(StepBuilder& m, std::string cause) {
  auto& s = m.s();
  if (s.machine != MachineState::continuous_execution) return m.enter(MachineState::ready, std::move(cause));
  s.activity = Activity::waiting_for_part;
  s.part_gone = !s.inputs.part_present;
  s.cause = std::move(cause);
  look_at_queue(m);
}

void count_result(StepBuilder& m, const std::string& job, bool good) {
  if (m.s().unjudged.erase(job) == 0) return;
  m.s().failures = good ? 0 : m.s().failures + 1;
  look_at_queue(m);
}

void inputs_read(StepBuilder& m, const PanelInputs& inputs) {
  auto& s = m.s();
  const bool turned_over = inputs.flipped && !s.inputs.flipped;
  s.inputs = inputs;
  if (!inputs.part_present) s.part_gone = true;
  if (s.activity == Activity::waiting_for_flip && s.job->recipe.flip_by_signal && turned_over) {
    s.job->turned_over = true;
    s.cause = kTurnedOver;
    if (const char* const why_not = m.unsafe()) s.cause += fmt::format(" {}", why_not);
  }
  handle_part_signals(m);
}

void handle_part_signals(StepBuilder& m) {
  auto& s = m.s();
  if (s.activity == Activity::waiting_for_flip && s.job->turned_over && !m.unsafe() && !m.absent_device()) {
    return continue_after_flip(m, kTurnedOver);
  }
  if (s.activity != Activity::waiting_for_part || !s.part_gone || !s.inputs.part_present) return;
  if (s.quiet || s.warm_up_left > std::chrono::seconds(0) || s.disk_problem) return;
  if (!goes_on_by_itself(s) || s.shutting_down || m.unsafe() || m.absent_device()) return;
  if (calibration_problem(s)) return;
  start_next_job(m, {}, "A new part is on the table.");
}

}  // namespace scanrig
