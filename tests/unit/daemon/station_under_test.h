#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "daemon/rig/acquisition.h"
#include "daemon/station/transition.h"

namespace scanrig {

/// Drives the pure transition function and keeps the requested actions.
class Station : public testing::Test {
 protected:
  void tell(const Event& event) {
    auto step = next(state, event, rules);
    state = std::move(step.state);
    actions = std::move(step.actions);
    refused = std::move(step.refused);
  }
  void press(Button button, Origin origin = Origin::panel) { tell(event::Pressed{button, origin, "job"}); }

  template <class SomeAction>
  const SomeAction* asked_for() const {
    for (const auto& action : actions) {
      if (const auto* found = std::get_if<SomeAction>(&action)) return found;
    }
    return nullptr;
  }

  void start_up() {
    tell(event::PanelFound{true, true});
    tell(event::Stopped{});
  }
  void get_ready() {
    start_up();
    press(Button::reset);
    tell(event::WarningOver{});
    tell(event::Homed{});
  }
  void begin_scan() {
    get_ready();
    press(Button::start);
    tell(event::JobStarted{"job", 0, 0});
    tell(event::WarningOver{});
  }
  void take(int pose, int view) {
    tell(event::ViewTaken{std::make_shared<TakenView>(TakenView{.id = {"job", pose, view}})});
  }
  void store(int pose, int view) { tell(event::ViewStored{{"job", pose, view}, 0.0}); }
  int views() const { return rules.recipes.at("default").views; }
  void take_and_store_all(int pose) {
    for (int view = 0; view < views(); ++view) {
      take(pose, view);
      store(pose, view);
    }
    close_pose(pose);
  }
  /// Takes view 0 again; nothing has moved.
  void close_pose(int pose, bool unmoved = true) {
    tell(event::CheckViewTaken{std::make_shared<TakenView>(TakenView{.id = {"job", pose, 0}})});
    tell(event::MovementChecked{"job", {.pose = pose, .unmoved = unmoved}});
  }
  static JobInfo queued(const std::string& id, std::int64_t place, Recipe recipe = {}) {
    return {.id = id, .folder = "/jobs/" + id, .recipe = std::move(recipe), .place = place};
  }
  void know(JobInfo job) { tell(event::JobUpdated{std::make_shared<const JobInfo>(std::move(job))}); }
  void reach_flip() {
    begin_scan();
    take_and_store_all(0);
    tell(event::PoseStored{"job", 0});
  }

  StationRules rules{.recipes = {{"default", {.poses = 2, .views = 4}}}};
  StationState state;
  std::vector<Action> actions;
  std::optional<Error> refused;
};

}  // namespace scanrig
