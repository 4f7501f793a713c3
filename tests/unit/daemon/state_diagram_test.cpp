// Walks through the transition function from its first state with every kind of event, and draws the result.
// SCANRIG_WRITE_DOCS=1 writes docs/reference/states.md; without it the test fails when the file differs from the
// code.
#include <gmock/gmock.h>

#include <cstdlib>
#include <deque>
#include <set>

#include "core/files.h"
#include "daemon/rig/acquisition.h"
#include "daemon/runtime/overloaded.h"
#include "daemon/station/job_lifecycle.h"
#include "daemon/station/operator_message.h"
#include "daemon/station/transition.h"

namespace scanrig {
namespace {

struct Named {
  const char* name;
  Event event;
};

struct Node {
  StationState state;
  JobTable jobs;
};

const Error kError{ErrorCode::io, "something failed"};

std::shared_ptr<const JobInfo> job(JobState state, const char* id = "job") {
  JobInfo info{.id = id, .state = state};
  info.recipe = {.poses = 2, .views = 1, .start_on_part = true};
  return std::make_shared<const JobInfo>(info);
}

event::InputsRead inputs(bool part) {
  event::InputsRead seen{};
  seen.inputs.part_present = part;
  return seen;
}

/// Buttons, the motor, its failures.
std::vector<Named> of_the_rig() {
  return {
      {"the panel answers", event::PanelFound{true, true}},
      {"Start", event::Pressed{Button::start, Origin::panel, "job"}},
      {"Stop", event::Pressed{Button::stop, Origin::panel, {}}},
      {"Reset", event::Pressed{Button::reset, Origin::panel, {}}},
      {"e-stop", event::EstopChanged{false}},
      {"2 s of warning", event::WarningOver{}},
      {"homed", event::Homed{}},
      {"seen stopped", event::Stopped{}},
      {"device failed", event::RigFailed{kError}},
      {"no e-stop", event::EstopWindowOver{}},
  };
}

/// Conditions that prevent motion.
std::vector<Named> of_safety() {
  return {
      {"e-stop released", event::EstopChanged{true}},
      {"guard opened", event::GuardChanged{false}},
      {"guard closed", event::GuardChanged{true}},
      {"not seen stopped", event::StopFailed{kError}},
      {"panel failed", event::PanelFailed{kError}},
      {"moved without a request", event::DevicesChecked{{}, event::DriveReport{true, {}}}},
  };
}

/// All events of a job.
std::vector<Named> of_jobs() {
  const auto view = std::make_shared<TakenView>(TakenView{.id = {"job", 0, 0}});
  return {
      {"ordered", event::JobUpdated{job(JobState::queued)}},
      {"cancelled", event::JobUpdated{job(JobState::cancelled)}},
      {"another ordered", event::JobUpdated{job(JobState::queued, "next")}},
      {"begun", event::JobStarted{"job", 0, 0}},
      {"does not fit", event::JobNotStarted{"job", kError}},
      {"folder damaged", event::JobUnreadable{"job", kError}},
      {"view taken", event::ViewTaken{view}},
      {"view stored", event::ViewStored{{"job", 0, 0}, 0.0}},
      {"view stored", event::ViewStored{{"job", 1, 0}, 0.0}},
      {"view 0 taken again", event::CheckViewTaken{view}},
      {"unmoved", event::MovementChecked{"job", {.unmoved = true}}},
      {"moved", event::MovementChecked{"job", {.unmoved = false}}},
      {"pose stored", event::PoseStored{"job", 0}},
      {"last pose stored", event::PoseStored{"job", 1}},
      {"flip time-out", event::FlipTimedOut{"job"}},
      {"disk failed", event::StoreFailed{"job", kError}},
      {"disk does not answer", event::DiskChecked{kError}},
      {"part taken away", inputs(false)},
      {"new part", inputs(true)},
      {"no model", event::ReconstructionFailed{"job", kError}},
      {"model ready", event::ModelReady{"job", "model", "report"}},
  };
}

/// All requests of an engineer.
std::vector<Named> of_maintenance() {
  using What = event::MaintenanceRequested::What;
  return {
      {"maintenance on", event::MaintenanceRequested{.what = What::on}},
      {"maintenance off", event::MaintenanceRequested{.what = What::off}},
      {"jog", event::MaintenanceRequested{.what = What::jog, .speed = {5}}},
      {"jogged", event::Jogged{}},
      {"pulse", event::MaintenanceRequested{.what = What::pulse}},
      {"pulsed", event::Pulsed{}},
      {"consent ended", event::ConsentTimeout{}},
  };
}

std::vector<Named> together(std::initializer_list<std::vector<Named>> parts) {
  std::vector<Named> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

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
    key += fmt::format("j{}{}{}{}{}{}{}{}{}{}", j.id, j.is_started, j.pose, j.asked, j.taken, j.stored,
                       j.movement_check_due, j.closing, j.reconstruction.has_value(), j.recipe.start_on_part);
  }
  return key + (s.activity == Activity::waiting_for_part ? std::to_string(s.failures) : "");
}

using Edges = std::map<std::pair<std::string, std::string>, std::set<std::string>>;

struct Walk {
  Edges machine, job;
  std::map<std::string, OperatorMessage> words;  ///< for the machine, where it was first reached
  std::set<std::string> wordless;                ///< states without a message, or without a next action
  std::set<std::string> untrue;                  ///< next actions that are refused
  std::set<std::string> unstoppable;             ///< states in which Stop is refused, not sent, or cancels a job
  std::size_t states = 0;
};

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
void close_jobs(Node& node, const std::vector<Action>& actions) {
  for (const auto& action : actions) {
    if (const auto* close = std::get_if<action::CloseJob>(&action)) {
      update(node.jobs, event::JobClosed{close->job, close->state, close->why});
    }
    if (std::holds_alternative<action::CreateJobs>(action)) node.jobs["job"] = job(JobState::queued);
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
          [&](const event::StoreFailed&) { return job != nullptr; },
          [&](const event::DiskChecked&) { return job != nullptr; },
          [&](const event::ReconstructionFailed&) { return job || state == JobState::reconstructing; },
          [&](const event::ModelReady&) { return listed && state == JobState::reconstructing; },
          [](const auto&) { return true; },
      },
      event);
}

/// `with_jobs`: the list of jobs makes a difference too.
void walk(const std::vector<Named>& events, bool with_jobs, Walk& walk) {
  StationRules rules{.recipes = {{"default", {.poses = 2, .views = 1}}}, .guard = true};
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
      close_jobs(after, step.actions);
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

/// Walks in parts, because independent parts need not be multiplied.
Walk walk_everywhere() {
  Walk all;
  walk(together({of_the_rig(), of_safety(), of_maintenance()}), false, all);
  walk(together({of_the_rig(), of_safety(), of_jobs()}), false, all);
  walk(together({of_the_rig(), of_jobs()}), true, all);
  return all;
}

std::string id_of(std::string name) {
  if (name == "[*]") return name;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

std::string draw(const Edges& edges) {
  std::set<std::string> names;
  for (const auto& [ends, why] : edges) names.insert({ends.first, ends.second});
  std::string text = "```mermaid\nstateDiagram-v2\n";
  for (const auto& name : names) {
    if (name != id_of(name)) text += fmt::format("  state \"{}\" as {}\n", name, id_of(name));
  }
  for (const auto& [ends, why] : edges) {
    text += fmt::format("  {} --> {} : {}\n", id_of(ends.first), id_of(ends.second), fmt::join(why, ", "));
  }
  return text + "```\n";
}

std::string table(const std::map<std::string, OperatorMessage>& words) {
  std::string text = "| state | sentence | next action |\n|---|---|---|\n";
  for (const auto& [state, said] : words) {
    text += fmt::format("| {} | {} | {} |\n", state, said.sentence, said.next_action);
  }
  return text;
}

std::string document(const Walk& walk) {
  return fmt::format(
      "# States\n\nGenerated by `tests/unit/daemon/state_diagram_test.cpp` from the {} states that `next()` in "
      "`daemon/station` can reach with one two-pose job and another queued behind it. Do not edit. The operator texts "
      "are in `daemon/station/operator_message.cpp`; what starts by itself is in "
      "[operating](../guide/operate.md#starting-by-itself).\n\n"
      "## A job\nAfter the last view the reconstruction decides. An interrupted job can be resumed, unless its part "
      "moved, and is queued again.\n\n{}\n"
      "## The machine\nFaults lead to Error from every state in which something moves or is about to. Refused events "
      "are not drawn.\n\n{}\n"
      "## Operator texts\nAs each state was first reached. What is wrong, or done already, changes them.\n\n{}",
      walk.states, draw(walk.job), draw(walk.machine), table(walk.words));
}

class StateDiagram : public testing::Test {
 protected:
  static const Walk& whole() {
    static const Walk result = walk_everywhere();
    return result;
  }
};

TEST_F(StateDiagram, IsTheOneInTheDocuments) {
  const auto file = std::filesystem::path(SCANRIG_SOURCE_DIR) / "docs" / "reference" / "states.md";
  const auto drawn = document(whole());
  if (std::getenv("SCANRIG_WRITE_DOCS")) {
    ASSERT_TRUE(write_file_atomically(file, drawn));
  }
  EXPECT_EQ(read_file(file).value_or(""), drawn) << "run SCANRIG_WRITE_DOCS=1 "
                                                 << "daemon_unit_test";
}

TEST_F(StateDiagram, EveryStateIsLeftAgain) {
  std::set<std::string> entered, left;
  for (const auto& [ends, why] : whole().machine) {
    left.insert(ends.first);
    entered.insert(ends.second);
  }
  for (const auto& state : entered) EXPECT_TRUE(left.contains(state)) << state << " is a dead end";
}

TEST_F(StateDiagram, EveryStateOfMachineAndJobSaysWhatToDo) {
  std::set<std::string> drawn, known;
  for (const auto& [ends, why] : whole().machine) drawn.insert(ends.second);
  for (const auto& [state, words] : whole().words) known.insert(state);
  EXPECT_TRUE(std::ranges::includes(known, drawn));
  EXPECT_TRUE(drawn.contains("Operational.ContinuousExecution: waiting_for_part"));
  EXPECT_THAT(whole().wordless, testing::IsEmpty());
}

TEST_F(StateDiagram, StopIsObeyedInEveryState) { EXPECT_THAT(whole().unstoppable, testing::IsEmpty()); }

TEST_F(StateDiagram, WhatAStateSaysToDoIsNotRefused) { EXPECT_THAT(whole().untrue, testing::IsEmpty()); }

/// An operator who closes the guard before a started queue is told the next step. Where a job's folder is damaged,
/// the next one with the same part text takes the part that Start was pressed for, after a separate warning.
TEST_F(StateDiagram, NothingMovesWithoutResetStartOrANewPart) {
  const std::set<std::string> allowed{"Reset", "Start", "new part", "jog", "folder damaged"};
  for (const auto& [ends, why] : whole().machine) {
    const bool about_to_move = ends.second.ends_with(": warning") && !ends.first.ends_with(": warning");
    if (!about_to_move) continue;
    const bool line = ends.first.ends_with(": waiting_for_part");
    for (const auto& name : why) {
      EXPECT_TRUE(allowed.contains(name) || (line && name == "guard closed")) << ends.first << " by " << name;
    }
  }
}

TEST_F(StateDiagram, AFaultIsLeftByResetAndMaintenanceOnly) {
  const std::set<std::string> allowed{"Reset", "maintenance on"};
  for (const auto& [ends, why] : whole().machine) {
    if (!ends.first.starts_with("Error") || ends.second.starts_with("Error")) continue;
    for (const auto& name : why) EXPECT_TRUE(allowed.contains(name)) << "to " << ends.second << " by " << name;
  }
}

TEST_F(StateDiagram, TheTableMovesOnlyAfterTheWarning) {
  for (const auto& [ends, why] : whole().machine) {
    const bool moves = ends.second.ends_with(": homing") || ends.second.ends_with(": jogging");
    if (moves) {
      EXPECT_TRUE(ends.first.ends_with(": warning")) << ends.first << " to " << ends.second;
    }
  }
}

}  // namespace
}  // namespace scanrig
