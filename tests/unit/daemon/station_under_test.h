#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "daemon/rig/taken_view.h"
#include "daemon/station/transition.h"

namespace scanrig {

/// Drives the pure transition function and keeps what it asked for.
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
    tell(event::JobCreated{"job", "/jobs/job"});
    tell(event::WarningOver{});
  }
  void take(int pose, int view) {
    tell(event::ViewTaken{std::make_shared<TakenView>(TakenView{.id = {"job", pose, view}})});
  }
  void store(int pose, int view) { tell(event::ViewStored{{"job", pose, view}, 0.0, 0}); }
  void take_and_store_all(int pose) {
    for (int view = 0; view < rules.views; ++view) {
      take(pose, view);
      store(pose, view);
    }
  }
  void reach_flip() {
    begin_scan();
    take_and_store_all(0);
    tell(event::PoseStored{"job", 0});
  }

  StationRules rules{.poses = 2, .views = 4, .remote = false};
  StationState state;
  std::vector<Action> actions;
  std::optional<Error> refused;
};

}  // namespace scanrig
