#include "daemon/journal/log_entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/station/job_lifecycle.h"

namespace scanrig {
namespace {

using Entries = std::vector<JournalEntry>;

std::string with_next(std::string text, const std::string& next_action) {
  return next_action.empty() ? text : fmt::format("{} Next: {}", text, next_action);
}

/// A fault concerns the job that was active when it happened.
void tell_fault(const Snapshot& before, const Snapshot& now, Entries& entries) {
  const bool other = before.machine != now.machine || before.cause != now.cause;
  if (other || before.may_be_moving != now.may_be_moving) {
    const auto cause = now.may_be_moving ? fmt::format("{} {}", now.cause, now.sentence) : now.cause;
    entries.push_back({Priority::error,
                       with_next(fmt::format("{}: {}", to_string(now.machine), cause), now.next_action),
                       before.job,
                       {},
                       {},
                       now.fault_device});
  } else if (before.next_action != now.next_action && !now.next_action.empty()) {
    entries.push_back({Priority::notice, with_next(std::string(to_string(now.machine)) + ".", now.next_action)});
  }
}

void tell_machine(const Snapshot& before, const Snapshot& now, Entries& entries) {
  if (now.machine == MachineState::error) return tell_fault(before, now, entries);
  if (before.machine == now.machine && before.cause == now.cause) return;
  entries.push_back({Priority::notice,
                     with_next(fmt::format("{}: {}", to_string(now.machine), now.cause), now.next_action), now.job});
}

void tell_devices(const Snapshot& before, const Snapshot& now, Entries& entries) {
  for (const auto& device : now.devices) {
    const auto was = std::ranges::find(before.devices, device.name, &DeviceHealth::name);
    const auto old = was == before.devices.end() ? std::optional<Error>() : was->problem;
    if (device.problem && (!old || old->message != device.problem->message)) {
      entries.push_back({.priority = Priority::warning,
                         .message = fmt::format("Not responding: {}.", device.problem->message),
                         .device = device.name});
    } else if (old && !device.problem) {
      entries.push_back({.priority = Priority::notice, .message = "It is back.", .device = device.name});
    }
  }
}

void tell_calibration(const Snapshot& before, const Snapshot& now, Entries& entries) {
  const auto &old = before.calibration_problem, &problem = now.calibration_problem;
  if (problem && (!old || old->message != problem->message)) {
    entries.push_back({Priority::warning, fmt::format("No scan with this calibration: {}.", problem->message)});
  } else if (old && !problem) {
    entries.push_back({Priority::notice, "The calibration does not refuse the next scan any more."});
  }
}

void report_retakes(const std::vector<Error>& retake_reasons, const std::string& job, int pose, int view,
                    Entries& entries) {
  for (const auto& why : retake_reasons) {
    entries.push_back({Priority::warning, fmt::format("Exposed again: {}.", why.message), job, pose, view});
  }
}

void tell_views(const JobInfo& before, const JobInfo& now, Entries& entries) {
  for (auto i = before.stored.size(); i < now.stored.size(); ++i) {
    const auto& view = now.stored[i];
    report_retakes(view.retake_reasons, now.id, view.pose, view.view, entries);
    entries.push_back(
        {Priority::info, fmt::format("Stored, taken at {:.3f} deg.", view.measured_deg), now.id, view.pose, view.view});
  }
  for (auto i = before.movement_checks.size(); i < now.movement_checks.size(); ++i) {
    const auto& movement_check = now.movement_checks[i];
    report_retakes(movement_check.retake_reasons, now.id, movement_check.pose, 0, entries);
    entries.push_back({movement_check.unmoved ? Priority::info : Priority::warning,
                       fmt::format("Movement check: {}, {:.2f} px and {:.1f} % of what is seen differ.",
                                   movement_check.unmoved ? "nothing has moved" : "something has moved",
                                   movement_check.shift_px, 100.0 * movement_check.changed),
                       now.id, movement_check.pose, 0});
  }
}

/// The counters grow when a stage ends, by its duration.
double seconds_of(const std::string& stage, const Snapshot& before, const Snapshot& now) {
  const auto total = [&](const Snapshot& snapshot) {
    const auto found = snapshot.counters.stage_seconds.find(stage);
    return found == snapshot.counters.stage_seconds.end() ? 0.0 : found->second;
  };
  return total(now) - total(before);
}

void tell_stages(const JobInfo& was, const JobInfo& job, const Snapshot& before, const Snapshot& now,
                 Entries& entries) {
  for (const auto& stage : job.stages) {
    const auto old = std::ranges::find(was.stages, stage.name, &StageShare::name);
    const bool ran = old != was.stages.end() && old->fraction < 1.0;
    const bool ended = old != was.stages.end() && old->fraction >= 1.0;
    const bool ends = stage.fraction >= 1.0;
    if (!ran && !(ended && ends))
      entries.push_back({Priority::info, fmt::format("Stage {} begins.", stage.name), job.id});
    if (ends && !ended) {
      entries.push_back({Priority::info,
                         fmt::format("Stage {} ends after {:.2f} s.", stage.name, seconds_of(stage.name, before, now)),
                         job.id});
    }
  }
}

void tell_state(const JobInfo& job, Entries& entries) {
  const bool bad = job.state == JobState::failed || job.state == JobState::interrupted || job.passed == false;
  std::string text(to_string(job.state));
  if (job.error) text += fmt::format(" ({}): {}", to_string(job.error->code), job.error->message);
  if (is_resumable(job)) text += "; it can be resumed";
  if (job.quarantined) text += "; quarantined";
  entries.push_back({bad ? Priority::error : Priority::notice, text + ".", job.id});
}

void tell_job(const JobInfo* was, const JobInfo& job, const Snapshot& before, const Snapshot& now, Entries& entries) {
  if (was) {
    tell_views(*was, job, entries);
    tell_stages(*was, job, before, now, entries);
  }
  if (!was || was->state != job.state) tell_state(job, entries);
}

void tell_jobs(const Snapshot& before, const Snapshot& now, Entries& entries) {
  auto was = before.jobs.begin();
  for (const auto& [id, job] : now.jobs) {
    while (was != before.jobs.end() && was->first < id) {
      entries.push_back({Priority::notice, "Removed.", was->first});
      ++was;
    }
    const bool known = was != before.jobs.end() && was->first == id;
    if (!known || was->second != job) tell_job(known ? was->second.get() : nullptr, *job, before, now, entries);
    if (known) ++was;
  }
  for (; was != before.jobs.end(); ++was) entries.push_back({Priority::notice, "Removed.", was->first});
}

}  // namespace

JournalEntry refused_at_panel(const event::Pressed& pressed, const Error& why, const Snapshot& now) {
  return {.priority = Priority::notice,
          .message = fmt::format("Pressed at the panel, {} is refused: {}", to_string(pressed.button), why.message),
          .job = now.job,
          .device = "panel"};
}

std::vector<JournalEntry> log_entries(const Snapshot& before, const Snapshot& now) {
  Entries entries;
  tell_jobs(before, now, entries);
  tell_machine(before, now, entries);
  tell_devices(before, now, entries);
  tell_calibration(before, now, entries);
  return entries;
}

}  // namespace scanrig
