#pragma once

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {

/// Jobs that are ordered, interrupted, resumed, kept: over fake devices, with real folders.
class Jobs : public Daemon {
 protected:
  void restart() {
    shut_down();
    boot();
    get_ready();
  }
  Result<std::string> ask_for(event::JobRequested::What what, const std::string& id) {
    return ask(event::JobRequested{.what = what, .job = id});
  }
  /// Interrupts a scan of three views per pose by the e-stop, in the exposure after `views` of its first pose.
  std::string interrupted_after(int views) {
    start_until_estop(2 * views);
    const auto id = newest()->id;
    EXPECT_TRUE(wait_state(id, JobState::interrupted));
    rig.panel.press(&PanelInputs::reset);
    EXPECT_TRUE(wait_ready());
    return id;
  }
  void finish(const std::string& id) {
    rig.panel.press(&PanelInputs::start);
    ASSERT_TRUE(wait_flip());
    rig.panel.press(&PanelInputs::start);
    EXPECT_TRUE(wait_state(id, JobState::done));
  }
  /// The ids of two jobs that have their models.
  std::array<std::string, 2> two_models() {
    boot();
    get_ready();
    std::array<std::string, 2> ids;
    for (auto& id : ids) {
      scan_both_poses();
      id = newest()->id;
      EXPECT_TRUE(wait_state(id, JobState::done));
      EXPECT_TRUE(wait_ready());
    }
    return ids;
  }
  void look_at(int scene) {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.scene = scene;
  }
};

}  // namespace scanrig
