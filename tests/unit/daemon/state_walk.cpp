#include "tests/unit/daemon/state_walk.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>

#include "core/overloaded.h"
#include "daemon/station/transition.h"

namespace scanrig::state_walk {
namespace {

struct Node {
  StationState state;
  JobTable jobs;
};

std::string job_state(const Node& node) {
  const auto found = node.jobs.find("job");
  return found == node.jobs.end() ? "[*]" : std::string(to_string(found->second->state));
}

std::string machine_state(const Node& node) {
  const auto machine = std::string(to_string(node.state.machine));
  if (node.state.activity == Activity::none) return machine;
  return machine + ": " + std::string(to_string(node.state.activity));
}

/// Parts of a state that make a difference to what comes next.
std::string key(const Node& node, bool with_jobs) {
  const auto& s = node.state;
  std::string key = machine_state(node) + (with_jobs ? job_state(node) : "");
  const bool line = s.machine == MachineState::continuous_execution;  // parts matter only there
  const bool require_devices =
      std::ranges::none_of(s.devices, [](const auto& device) { return device.problem.has_value(); });
  for (const bool flag : {s.panel_known, s.estop_ok, s.guard_closed, s.latch.has_value(), s.unclassified.has_value(),
                          s.may_be_moving, line && s.part_gone, line && s.inputs.part_present, require_devices}) {
    key += flag ? '1' : '0';
  }
  for (const auto& queued : s.queue) key += queued->id;
  if (s.maintenance) {
    key += fmt::format("m{}{}{}{}", static_cast<int>(s.maintenance->before), s.maintenance->moved, s.maintenance->homed,
                       s.maintenance->jog.has_value());
  }
  if (s.job) {
    const auto& j = *s.job;
    key += fmt::format("j{}{}{}{}{}{}{}{}{}{}{}{}", j.id, j.is_started, j.pose, j.asked, j.taken, j.stored,
                       j.movement_check_due, j.closing, j.reconstruction.has_value(), j.recipe.start_on_part, j.turning,
                       j.repeated.empty());
  }
  return key + (s.activity == Activity::waiting_for_part ? std::to_string(s.failures) : "");
}

/// An operator who follows the next action is not refused.
void listen(const Node& node, const StationRules& rules, Walk& walk) {
  const auto name = machine_state(node);
  const auto words = describe(node.state, rules);
  walk.words.try_emplace(name, words);
  if (words.sentence.empty() || words.next_action.empty()) walk.wordless.insert(name);
  for (const auto& [id, known] : node.jobs) {
    const auto of_job = describe(*known);
    if (of_job.sentence.empty() || of_job.next_action.empty()) walk.wordless.insert(job_state(node));
  }
  const auto told = [&](const char* what) { return words.next_action.find(what) != std::string::npos; };
  auto state = node.state;
  if (told("e-stop")) state = next(state, event::EstopChanged{true}, rules).state;
  if (told("guard")) state = next(state, event::GuardChanged{true}, rules).state;
  if (told("Check the turntable")) state = next(state, event::DevicesChecked{{{"turntable", {}}}}, rules).state;
  const std::pair<const char*, Event> asked[] = {
      {"ress Reset", event::Pressed{Button::reset, Origin::panel, {}}},
      {"ress Start", event::Pressed{Button::start, Origin::panel, "job"}},
      {"og the table", event::MaintenanceRequested{.what = event::MaintenanceRequested::What::jog, .speed = {5}}}};
  for (const auto& [what, event] : asked) {
    if (!told(what)) continue;
    const auto step = next(state, event, rules);
    if (step.refused) walk.untrue.insert(fmt::format("{}: {} But: {}", name, words.next_action, step.refused->message));
  }
}

void press_stop(const Node& node, const StationRules& rules, Walk& walk) {
  for (const auto origin : {Origin::panel, Origin::remote}) {
    const auto step = next(node.state, event::Pressed{Button::stop, origin, {}}, rules);
    const auto has = [&](const auto& is_it) { return std::ranges::any_of(step.actions, is_it); };
    const bool sent = has([](const Action& a) {
      return std::holds_alternative<action::StopRig>(a) || std::holds_alternative<action::StopTableDirectly>(a) ||
             std::holds_alternative<action::StopTableOutside>(a);
    });
    const bool cancels = has([](const Action& a) {
      const auto* close = std::get_if<action::CloseJob>(&a);
      return close && close->state != JobState::interrupted;
    });
    const bool stopping = step.state.activity == Activity::stopping;
    if (step.refused || !sent || cancels || !stopping) walk.unstoppable.insert(machine_state(node));
  }
}

/// The rest of the station replies as in operation: a job that is closed is closed on disk.
void close_jobs(Node& node, const std::vector<Action>& actions, RecipeKind kind) {
  for (const auto& action : actions) {
    if (const auto* close = std::get_if<action::CloseJob>(&action)) {
      update(node.jobs, event::JobClosed{close->job, close->state, close->why});
    }
    if (std::holds_alternative<action::CreateJobs>(action)) node.jobs["job"] = job(JobState::queued, "job", kind);
  }
}

/// A new job takes the place of the last one in the walk; that is not a transition of a job.
bool is_another_job(const std::vector<Action>& actions) {
  return std::ranges::any_of(actions, [](const Action& a) { return std::holds_alternative<action::CreateJobs>(a); });
}

/// No reply comes without a request.
bool can_happen(const Node& node, const Event& event) {
  const auto& s = node.state;
  const auto* const job = s.job && s.job->id == "job" ? &*s.job : nullptr;
  const bool listed = node.jobs.contains("job");
  const auto state = listed ? node.jobs.at("job")->state : JobState::done;
  return std::visit(
      Overloaded{
          [&](const event::Stopped&) { return s.activity == Activity::stopping || s.may_be_moving; },
          [&](const event::DevicesChecked&) {
            return s.activity == Activity::none || s.activity == Activity::warning ||
                   s.activity == Activity::waiting_for_flip || s.activity == Activity::waiting_for_part;
          },
          [&](const event::StopFailed&) { return s.activity == Activity::stopping; },
          [&](const event::JobUpdated& e) {
            if (e.info->id != "job") return job && s.queue.empty();  // one is enough
            const bool waits = state == JobState::queued || state == JobState::interrupted;
            if (e.info->state == JobState::queued) return !s.job && (!listed || state == JobState::interrupted);
            return !s.job && listed && (waits || state == JobState::reconstructing);
          },
          [&](const event::JobStarted&) { return job && !job->is_started; },
          [&](const event::JobNotStarted&) { return job && !job->is_started; },
          [&](const event::JobUnreadable&) { return job && !job->is_started; },
          [&](const event::ViewTaken&) { return job && job->taken < job->asked; },
          [&](const event::ViewStored& e) { return job && e.id.pose == job->pose && job->stored < job->taken; },
          [&](const event::CheckViewTaken&) { return job && job->closing && s.activity == Activity::scanning; },
          [&](const event::MovementChecked&) { return job && job->closing && job->stored == job->taken; },
          [&](const event::PoseStored& e) {
            return job && !job->closing && e.pose == job->pose && s.activity == Activity::storing;
          },
          [&](const event::PlacementChecked& e) {
            return job && !job->closing && e.pose == job->pose && s.activity == Activity::storing;
          },
          [&](const event::PlacementDropped& e) {
            return job && !job->closing && e.pose == job->pose && s.activity == Activity::storing;
          },
          [&](const event::ImagesChecked&) { return job != nullptr; },
          [&](const event::Turned&) { return job && job->turning && s.activity == Activity::scanning; },
          [&](const event::StoreFailed&) { return job != nullptr; },
          [&](const event::DiskChecked&) { return job != nullptr; },
          [&](const event::ReconstructionFailed&) { return job || state == JobState::reconstructing; },
          [&](const event::ModelReady&) { return listed && state == JobState::reconstructing; },
          [](const auto&) { return true; },
      },
      event);
}

}  // namespace

std::shared_ptr<const JobInfo> job(JobState state, const char* id, RecipeKind kind) {
  JobInfo info{.id = id, .state = state};
  info.recipe = {.poses = 2, .views = 1, .start_on_part = kind == RecipeKind::scan, .kind = kind};
  return std::make_shared<const JobInfo>(info);
}

void walk(const std::vector<Named>& events, bool with_jobs, Walk& walk, RecipeKind kind) {
  StationRules rules{.recipes = {{"default", {.poses = 2, .views = 1, .kind = kind}}}, .guard = true};
  std::deque<Node> open{Node{}};
  std::set<std::string> seen{key(open.front(), with_jobs)};
  while (!open.empty()) {
    const Node before = std::move(open.front());
    open.pop_front();
    listen(before, rules, walk);
    press_stop(before, rules, walk);
    for (const auto& [name, event] : events) {
      if (!can_happen(before, event)) continue;
      auto step = next(before.state, event, rules);
      if (step.refused) continue;
      Node after{std::move(step.state), before.jobs};
      update(after.jobs, event);
      close_jobs(after, step.actions, kind);
      if (machine_state(before) != machine_state(after)) {
        walk.machine[{machine_state(before), machine_state(after)}].insert(name);
      }
      // A late event of a job that has ended is not a transition of a job.
      const bool alive =
          !before.jobs.contains("job") || (!is_final(before.jobs.at("job")->state) && !is_another_job(step.actions));
      if (with_jobs && alive && job_state(before) != job_state(after)) {
        walk.job[{job_state(before), job_state(after)}].insert(name);
      }
      if (seen.insert(key(after, with_jobs)).second) open.push_back(std::move(after));
    }
  }
  walk.states += seen.size();
}

}  // namespace scanrig::state_walk
