#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/result.h"
#include "core/units.h"
#include "daemon/station/states.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Which view of which job; poses and views count from 0.
struct ViewId {
  std::string job;
  int pose = 0;
  int view = 0;
  bool operator==(const ViewId&) const = default;
};

struct TakenView;  // daemon/rig/taken_view.h

/// Whether a device answers. One that does not leaves the rest running.
struct DeviceHealth {
  std::string name;
  std::optional<Error> problem{};
  bool operator==(const DeviceHealth& other) const {
    return name == other.name && problem.has_value() == other.problem.has_value() &&
           (!problem || problem->message == other.problem->message);
  }
};

/// What happened: told to the station by its threads, the panel and the API.
namespace event {
struct PanelFound {
  bool estop_ok, guard_closed;
};  ///< the panel's first answer, or its first after it could not be read
struct InputsSeen {
  PanelInputs inputs;
};  ///< for the I/O table
struct Pressed {
  Button button;
  Origin origin;
  std::string fresh_job_id;
};
struct EstopChanged {
  bool ok;
};
struct GuardChanged {
  bool closed;
};
struct WarningOver {};
struct EstopWindowOver {};  ///< an e-stop would have been seen by now
struct StopRetryDue {};
struct CheckDue {};
struct DevicesSeen {
  std::vector<DeviceHealth> devices;
};
/// What an engineer asks for.
struct MaintenanceAsked {
  enum class What { on, off, home, jog, pulse, lamp_test };
  What what;
  Degrees angle{};  ///< jog: where to, or by how much
  bool relative = false;
  DegreesPerSecond speed{};  ///< jog
};
struct Jogged {
  Degrees measured;
};
struct Pulsed {};
struct Homed {};
struct ViewTaken {
  std::shared_ptr<const TakenView> view;
};
struct Stopped {
  std::optional<Error> light{};  ///< why the projector is not known to be dark
};                               ///< the table is seen standing
struct RigFailed {
  Error error;
};  ///< a move or an exposure; the motor has been told to stop
struct StopFailed {
  Error error;
};  ///< nobody knows whether the table moves
struct PanelFailed {
  Error error;
};
struct JobCreated {
  std::string job, folder;
};
struct ViewStored {
  ViewId id;
  double measured_deg;
  int redone;
  double commanded_deg = 0.0;
  double settling_ms = 0.0;
};  ///< it survives a power cut
struct PoseStored {
  std::string job;
  int pose;
};
struct JobClosed {
  std::string job;
  JobState state;
  Error why;
};
struct StoreFailed {
  std::string job;
  Error error;
};
struct StageProgress {
  std::string job, stage;
  double fraction;
};
struct ReconstructionFailed {
  std::string job;
  Error error;
};
struct ModelReady {
  std::string job, model, report;
};  ///< paths of the files
struct Shutdown {};
}  // namespace event

using Event =
    std::variant<event::PanelFound, event::InputsSeen, event::Pressed, event::EstopChanged, event::GuardChanged,
                 event::WarningOver, event::EstopWindowOver, event::StopRetryDue, event::CheckDue, event::DevicesSeen,
                 event::MaintenanceAsked, event::Jogged, event::Pulsed, event::Homed, event::ViewTaken, event::Stopped,
                 event::RigFailed, event::StopFailed, event::PanelFailed, event::JobCreated, event::ViewStored,
                 event::PoseStored, event::JobClosed, event::StoreFailed, event::StageProgress,
                 event::ReconstructionFailed, event::ModelReady, event::Shutdown>;

/// What is to be done about it. None of them waits.
namespace action {
struct Warn {};            ///< WarningOver comes after the warning time
struct WaitForEstop {};    ///< EstopWindowOver comes after the window
struct RetryStopLater {};  ///< StopRetryDue comes after a while
struct CheckLater {};      ///< CheckDue comes after a while
struct CheckDevices {};    ///< answered by DevicesSeen
struct Home {};            ///< clears a device alarm first
struct StopRig {};         ///< answered by Stopped or StopFailed
struct Jog {
  Degrees angle;
  bool relative;
  DegreesPerSecond speed;
};                ///< answered by Jogged or RigFailed
struct Pulse {};  ///< answered by Pulsed or RigFailed
struct TestLamps {};
struct TakeView {
  ViewId id;
  Degrees angle;
};
struct CreateJob {
  std::string job;
};
struct StoreView {
  std::shared_ptr<const TakenView> view;
};
struct FinishPose {
  std::string job;
  int pose;
  bool last;
};  ///< the manifest says: complete; waiting or scanned
struct ResumeJob {
  std::string job;
};  ///< the manifest says: scanning again
struct CloseJob {
  std::string job;
  JobState state;
  Error why;
};
}  // namespace action

using Action =
    std::variant<action::Warn, action::WaitForEstop, action::RetryStopLater, action::CheckLater, action::CheckDevices,
                 action::Home, action::StopRig, action::Jog, action::Pulse, action::TestLamps, action::TakeView,
                 action::CreateJob, action::StoreView, action::FinishPose, action::ResumeJob, action::CloseJob>;

}  // namespace scanrig
