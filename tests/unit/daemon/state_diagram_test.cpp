// Walks through the transition function from its first state with every kind of event, and draws the result.
// SCANRIG_WRITE_DOCS=1 writes docs/reference/states.md; without it the test fails when the file differs from the
// code.
#include <gmock/gmock.h>

#include <cstdlib>
#include <set>

#include "core/files.h"
#include "daemon/rig/acquisition.h"
#include "tests/unit/daemon/state_walk.h"

namespace scanrig {
namespace {

using state_walk::Edges;
using state_walk::job;
using state_walk::Named;
using state_walk::walk;
using state_walk::Walk;

const Error kError{ErrorCode::io, "something failed"};

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
std::vector<Named> of_jobs(RecipeKind kind = RecipeKind::scan) {
  const auto view = std::make_shared<TakenView>(TakenView{.id = {"job", 0, 0}});
  return {
      {"ordered", event::JobUpdated{job(JobState::queued, "job", kind)}},
      {"cancelled", event::JobUpdated{job(JobState::cancelled, "job", kind)}},
      {"another ordered", event::JobUpdated{job(JobState::queued, "next", kind)}},
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

/// Further events of a calibration.
std::vector<Named> of_placements() {
  return {
      {"images examined", event::ImagesChecked{{"job", 0, 0}, {"left: no board"}}},
      {"enough good views", event::PlacementChecked{"job", 0}},
      {"too few good views", event::PlacementChecked{"job", 0, kError}},
      {"enough good views", event::PlacementChecked{"job", 1}},
      {"views dropped", event::PlacementDropped{"job", 0, kError}},
      {"views dropped", event::PlacementDropped{"job", 1, kError}},
      {"mark in front", event::Turned{}},
  };
}

/// All requests of an engineer.
std::vector<Named> of_maintenance() {
  using Task = event::MaintenanceRequested::What;
  return {
      {"maintenance on", event::MaintenanceRequested{.what = Task::on}},
      {"maintenance off", event::MaintenanceRequested{.what = Task::off}},
      {"jog", event::MaintenanceRequested{.what = Task::jog, .speed = {5}}},
      {"jogged", event::Jogged{}},
      {"pulse", event::MaintenanceRequested{.what = Task::pulse}},
      {"pulsed", event::Pulsed{}},
      {"consent ended", event::ConsentTimeout{}},
  };
}

std::vector<Named> together(std::initializer_list<std::vector<Named>> parts) {
  std::vector<Named> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// Walks in parts, because independent parts need not be multiplied.
Walk walk_everywhere() {
  Walk all;
  walk(together({of_the_rig(), of_safety(), of_maintenance()}), false, all);
  walk(together({of_the_rig(), of_safety(), of_jobs()}), false, all);
  walk(together({of_the_rig(), of_jobs()}), true, all);
  return all;
}

/// The same for calibrations of two placements.
Walk walk_calibrations() {
  Walk all;
  constexpr auto kKind = RecipeKind::calibration;
  walk(together({of_the_rig(), of_safety(), of_jobs(kKind), of_placements()}), false, all, kKind);
  walk(together({of_the_rig(), of_jobs(kKind), of_placements()}), true, all, kKind);
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

/// As ControlLoop begins it, and what each press leads to.
std::string lent() {
  StationRules rules;
  rules.lent = true;
  StationState begun;
  begun.machine = MachineState::maintenance;
  begun.maintenance.emplace();
  const auto stopping = next(begun, event::Pressed{Button::stop, Origin::remote, {}}, rules).state;
  return table({{"lent", describe(begun, rules)}, {"lent: stopping", describe(stopping, rules)}});
}

std::string document(const Walk& walk, const Walk& calibrations) {
  return fmt::format(
      "# States\n\nGenerated by `tests/unit/daemon/state_diagram_test.cpp` from the {} states that `next()` in "
      "`daemon/station` can reach with one two-pose job and another queued behind it. Do not edit. The operator texts "
      "are in `daemon/station/operator_message.cpp`; what starts by itself is in "
      "[operating](../guide/operate.md#starting-by-itself).\n\n"
      "## A job\nAfter the last view the reconstruction decides. An interrupted job can be resumed, unless its part "
      "moved, and is queued again.\n\n{}\n"
      "## A calibration\nThe same states with placements of a board for poses, here two; `waiting_for_flip` waits for "
      "the "
      "board. A placement in which the board slipped, or with too few good views, is taken again. Before it waits, the "
      "table turns to the mark. Drawn from {} further states. The machine has no others.\n\n{}\n"
      "## The machine\nFaults lead to Error from every state in which something moves or is about to. Refused events "
      "are not drawn.\n\n{}\n"
      "## Lent to setup\nFrom Halted.Maintenance, once the table is seen stopped, the service closes its devices for "
      "setup on the page and restarts over none: Halted.Maintenance, lent. There only Stop is obeyed. When setup ends, "
      "by Stop too, another process stops the table, and the service restarts with its devices: Preoperational.\n\n"
      "{}\n"
      "## Operator texts\nAs each state was first reached. What is wrong, or done already, changes them.\n\n{}",
      walk.states, draw(walk.job), calibrations.states, draw(calibrations.job), draw(walk.machine), lent(),
      table(walk.words));
}

class StateDiagram : public testing::Test {
 protected:
  static const Walk& calibrations() {
    static const Walk result = walk_calibrations();
    return result;
  }
  static const Walk& whole() {
    static const Walk result = walk_everywhere();
    return result;
  }
};

TEST_F(StateDiagram, IsTheOneInTheDocuments) {
  const auto file = std::filesystem::path(SCANRIG_SOURCE_DIR) / "docs" / "reference" / "states.md";
  const auto drawn = document(whole(), calibrations());
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

TEST_F(StateDiagram, StopIsObeyedInEveryState) {
  EXPECT_THAT(whole().unstoppable, testing::IsEmpty());
  EXPECT_THAT(calibrations().unstoppable, testing::IsEmpty());
}

TEST_F(StateDiagram, WhatAStateSaysToDoIsNotRefused) {
  EXPECT_THAT(whole().untrue, testing::IsEmpty());
  EXPECT_THAT(calibrations().untrue, testing::IsEmpty());
}

TEST_F(StateDiagram, ACalibrationSaysWhatToDoAndHasNoStatesOfItsOwn) {
  EXPECT_THAT(calibrations().wordless, testing::IsEmpty());
  std::set<std::string> known;
  for (const auto& [state, words] : whole().words) known.insert(state);
  for (const auto& [state, words] : calibrations().words) EXPECT_TRUE(known.contains(state)) << state;
}

/// An operator who closes the guard before a started queue is told the next step. Where a job's folder is damaged,
/// the next one with the same part text takes the part that Start was pressed for, after a separate warning.
TEST_F(StateDiagram, NothingMovesWithoutResetStartOrANewPart) {
  const std::set<std::string> allowed{"Reset", "Start", "new part", "jog", "folder damaged"};
  auto machine = whole().machine;
  machine.insert(calibrations().machine.begin(), calibrations().machine.end());
  for (const auto& [ends, why] : machine) {
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
