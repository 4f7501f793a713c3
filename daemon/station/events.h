#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/result.h"
#include "core/units.h"
#include "daemon/runtime/device_watch.h"
#include "daemon/station/job_info.h"
#include "daemon/station/states.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// One view of one job; poses and views count from 0.
struct ViewId {
  std::string job;
  int pose = 0;
  int view = 0;
  bool operator==(const ViewId&) const = default;
};

struct TakenView;  // daemon/rig/acquisition.h

/// Scans to be done: one job each.
struct JobOrder {
  std::string recipe = "default";
  std::string part{};  ///< free text, at most 200 bytes
  int repeat = 1;      ///< 1 to 100
  /// A calibration, or a check of it: instead, at the head of the queue; the rest is not used.
  RecipeKind kind = RecipeKind::scan;
};

/// Identifies the requester waiting for a reply; 0: no requester.
using RequestId = std::uint64_t;

/// Whether a device responds. One that does not leaves the rest running.
struct DeviceHealth {
  std::string name;
  std::optional<Error> problem{};
  bool operator==(const DeviceHealth& other) const {
    return name == other.name && problem.has_value() == other.problem.has_value() &&
           (!problem || problem->message == other.problem->message);
  }
};

/// Events reported to the station by its threads, the panel and the API.
namespace event {
struct PanelFound {
  bool estop_ok, guard_closed;
};  ///< the panel's first reading, or its first after a failure
struct InputsRead {
  PanelInputs inputs;
};  ///< for the I/O table
struct Pressed {
  Button button;
  Origin origin;
  std::string new_job_id;
  std::string offer{};      ///< start_offer() that the requester has seen; empty: none is to be compared
  std::string requester{};  ///< who sent the request, for others to read; empty: unknown
};
struct EstopChanged {
  bool ok;
};
struct GuardChanged {
  bool closed;
};
struct WarningOver {};
struct EstopWindowOver {};  ///< an e-stop would have been read by now
struct StopRetryDue {};
struct CheckDue {};
struct QuietHours {
  bool quiet;
};  ///< they have started or ended
struct WarmingUp {
  std::chrono::seconds left;
};  ///< time when the projector is warm; 0: it is
/// Whose calibration was checked, as in action::CheckCalibration, and why it refuses a scan.
struct CalibrationChecked {
  std::string job{};
  std::optional<Error> problem{};
  std::string reminder{};  ///< that it is old, as a sentence; empty: it is not
};
/// Reports of the turntable's drive while no motion is requested.
struct DriveReport {
  bool is_moving = false;
  std::string alarm{};  ///< in words; empty: none
};
struct DevicesChecked {
  std::vector<DeviceHealth> devices;
  std::optional<DriveReport> drive{};  ///< nothing: the turntable is absent
};
/// A call of turntable, projector or camera hangs; nothing: it has returned.
struct HungCallChanged {
  std::optional<HungCall> call{};
};
/// Actions that an engineer requests.
struct MaintenanceRequested {
  enum class What { on, off, home, jog, pulse, lamp_test };
  What what;
  Degrees angle{};  ///< jog: target, or change
  bool relative = false;
  DegreesPerSecond speed{};  ///< jog
  std::string requester{};   ///< the user of this machine or the address that sent the request; empty: unknown
};
struct ConsentTimeout {};  ///< nothing has moved in maintenance for a while
struct Jogged {
  Degrees measured;
};
struct Pulsed {};
struct Homed {};
struct Turned {};  ///< to the next placement's mark
struct ViewTaken {
  std::shared_ptr<const TakenView> view;
};
struct Stopped {
  std::optional<Error> light{};  ///< why the projector may not be off
};                               ///< standstill confirmed
struct RigFailed {
  Error error;
  std::string device{};  ///< whose failure it is, as DeviceHealth names it
};                       ///< a move or an exposure; the motor has been commanded to stop
struct StopFailed {
  Error error;
};  ///< unconfirmed: the table may be moving
struct PanelFailed {
  Error error;
};
/// A client requests scans. RequestDone when every job's folder is durable, with the first one's id.
struct JobsOrdered {
  JobOrder order;
  std::vector<std::string> new_ids{};  ///< one per job
  RequestId request_id = 0;
};
/// A client requests an action on one job. RequestDone when it is done.
struct JobRequested {
  enum class What {
    cancel,        ///< queued, interrupted or reconstructing: ends cancelled, with its evidence
    resume,        ///< interrupted: the next Start continues it
    to_front,      ///< queued: the next Start starts it
    remove,        ///< deletes the folder; only of a job that has ended
    reprocess,     ///< the reconstruction again, from the images; `voxel_mm` and `fusion` may change it
    set_exported,  ///< retention may delete it
    bundle,        ///< packed into the file `path`, for support
    accept,        ///< a calibration that is solved becomes the rig's
    choose,        ///< of the ways in which pose 2 fits, `number` is right; then as reprocess
    add_pose,      ///< a scan with all its views gets another pose; the next Start scans it
  };
  What what;
  std::string job;
  std::string path{};                ///< bundle: absolute, .tar.gz, must not exist
  std::optional<double> voxel_mm{};  ///< reprocess
  std::string fusion{};              ///< reprocess: `evidence`, `paper`; empty: as configured
  int number = 0;                    ///< choose: from 1
  RequestId request_id = 0;
};
/// The request `request_id` has been done, or why not.
struct RequestDone {
  RequestId request_id;
  Result<std::string> result;
};
/// The present content of a job's folder: a new job, or one changed in other ways than by being scanned.
struct JobUpdated {
  std::shared_ptr<const JobInfo> info;
};
struct JobRemoved {
  std::string job;
};
/// The job is active: it continues after `stored` views of `pose`.
struct JobStarted {
  std::string job;
  int pose, stored;
};
/// The job did not start: the disk is too full. It stays queued.
struct JobNotStarted {
  std::string job;
  Error why;
};
/// The job did not start and never will: its folder is damaged. It has failed.
struct JobUnreadable {
  std::string job;
  Error why;
};
struct CheckViewTaken {
  std::shared_ptr<const TakenView> view;
};
struct MovementChecked {
  std::string job;
  MovementCheck movement_check;
};
struct FlipTimedOut {
  std::string job;
};
/// The images of one view of a calibration were examined.
struct ImagesChecked {
  ViewId id;
  std::vector<std::string> problems;  ///< for the operator; empty: both are good
};
/// Whether enough views of a placement are good; `problem`: why not.
struct PlacementChecked {
  std::string job;
  int pose;
  std::optional<Error> problem{};
};
/// The views of a placement were dropped: it is taken again.
struct PlacementDropped {
  std::string job;
  int pose;
  Error why;
};
struct ViewStored {
  ViewId id;
  double measured_deg;
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
  double commanded_deg = 0.0;
  double settling_ms = 0.0;
  std::vector<std::string> config_sha256{};  ///< of all configurations that the job's views were taken under
};                                           ///< it survives a power cut
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
struct DiskChecked {
  std::optional<Error> problem{};
};  ///< the job disk has stopped responding, or responds again
struct StageProgress {
  std::string job, stage;
  double fraction;
};
/// Meshes of what the scan shows so far, all of them: names of files in the job's folder live/.
struct LiveMeshes {
  std::string job;
  std::vector<std::string> names;
};
/// How the part could lie in the next pose, best first; none: it is not known.
struct RestsSuggested {
  std::string job;
  std::vector<SuggestedRest> rests;
};
struct ReconstructionFailed {
  std::string job;
  Error error;
  bool quarantined = false;          ///< it was not tried
  std::vector<JobChoice> choices{};  ///< for the operator, where one of them would have ended it well
};
struct ModelReady {
  std::string job, model, report;          ///< paths of the files
  std::optional<Error> limit_violation{};  ///< why the model did not pass
  std::optional<CalibrationOutcome> calibration{};
  std::vector<std::string> remarks{};
};
/// The daemon is to restart; accepted only while the rig is idle.
struct ReloadRequested {
  enum class Why {
    configuration,  ///< it has changed
    lend,           ///< from maintenance: the devices are closed, so that setup can have them
    give_back       ///< setup is over, the devices are opened again
  };
  std::string still_doing{};  ///< work that continues beside the rig; empty: none
  Why why = Why::configuration;
};
struct Shutdown {};
}  // namespace event

using Event =
    std::variant<event::PanelFound, event::InputsRead, event::Pressed, event::EstopChanged, event::GuardChanged,
                 event::WarningOver, event::EstopWindowOver, event::StopRetryDue, event::CheckDue, event::QuietHours,
                 event::WarmingUp, event::DevicesChecked, event::HungCallChanged, event::CalibrationChecked,
                 event::MaintenanceRequested, event::ConsentTimeout, event::Jogged, event::Pulsed, event::Homed,
                 event::Turned, event::ImagesChecked, event::PlacementChecked, event::PlacementDropped,
                 event::ViewTaken, event::Stopped, event::RigFailed, event::StopFailed, event::PanelFailed,
                 event::JobsOrdered, event::JobRequested, event::RequestDone, event::JobUpdated, event::JobRemoved,
                 event::JobStarted, event::JobNotStarted, event::JobUnreadable, event::CheckViewTaken,
                 event::MovementChecked, event::FlipTimedOut, event::ViewStored, event::PoseStored, event::JobClosed,
                 event::StoreFailed, event::DiskChecked, event::StageProgress, event::LiveMeshes, event::RestsSuggested,
                 event::ReconstructionFailed, event::ModelReady, event::ReloadRequested, event::Shutdown>;

/// Actions that the station requests. None of them waits.
namespace action {
struct Warn {};            ///< WarningOver comes after the warning time
struct WaitForEstop {};    ///< EstopWindowOver comes after the window
struct RetryStopLater {};  ///< StopRetryDue comes after a while
struct EndConsentLater {
  std::chrono::minutes after;
};                       ///< ConsentTimeout comes after it, counted anew each time
struct CheckLater {};    ///< CheckDue comes after a while
struct CheckDevices {};  ///< replied to by DevicesChecked
/// Checks that it belongs to the rig's cameras. RequestDone by CalibrationChecked.
struct CheckCalibration {
  std::string job;  ///< whose views were taken with it; empty: the rig's, for a scan without one so far
};
struct Home {};     ///< clears a device alarm first
struct StopRig {};  ///< replied to by Stopped or StopFailed
/// The same past a projector or camera that hangs, on the turntable's own thread.
struct StopTableDirectly {};
/// The same past a turntable that hangs, by another process.
struct StopTableOutside {};
struct Jog {
  Degrees angle;
  bool relative;
  DegreesPerSecond speed;
};                ///< replied to by Jogged or RigFailed
struct Pulse {};  ///< replied to by Pulsed or RigFailed
struct TestLamps {};
struct TakeView {
  ViewId id;
  Degrees angle;
  bool movement_check = false;  ///< view 0 again, for comparison: CheckViewTaken follows instead of ViewTaken
  bool plain_only = false;      ///< without the pattern, as a calibration is taken
};
/// Turns without an exposure, for the next placement. Replied to by Turned or RigFailed.
struct TurnTo {
  Degrees angle;
};
struct WaitForFlip {
  std::string job;
  std::chrono::minutes limit;
};  ///< FlipTimedOut comes after it
/// Creates job folders in the state queued, one after the other. Each is reported as JobUpdated.
struct CreateJobs {
  std::vector<std::string> ids;
  Recipe recipe;
  std::string part;
  std::int64_t place;  ///< of the first
  RequestId request_id;
};
struct StartJob {
  std::string job;
};  ///< replied to by JobStarted, JobNotStarted or JobUnreadable
struct MoveJob {
  std::string job;
  std::int64_t place;
  enum class How {
    queued,    ///< as it is
    resumed,   ///< an interrupted job is queued again
    one_more,  ///< a whole scan is queued for another pose
  };
  How how;
  RequestId request_id;
};
/// All other requested actions on a job that is not active.
struct RunJobRequest {
  event::JobRequested asked;
};
struct CheckMovement {
  std::shared_ptr<const TakenView> view;
};
struct StoreView {
  std::shared_ptr<const TakenView> view;
};
struct CheckPlacement {
  std::string job;
  int pose;
};  ///< replied to by PlacementChecked, when all its views were examined
struct DropPlacement {
  std::string job;
  int pose;
  Error why;
};  ///< replied to by PlacementDropped
struct FinishPose {
  std::string job;
  int pose;
  bool last;
};  ///< sets the manifest to: complete; waiting or scanned
struct ResumeJob {
  std::string job;
};  ///< after the flip, sets the manifest to: scanning again
struct CloseJob {
  std::string job;
  JobState state;
  Error why;
};
}  // namespace action

using Action =
    std::variant<action::Warn, action::WaitForEstop, action::RetryStopLater, action::EndConsentLater,
                 action::CheckLater, action::CheckDevices, action::CheckCalibration, action::Home, action::StopRig,
                 action::StopTableDirectly, action::StopTableOutside, action::Jog, action::Pulse, action::TestLamps,
                 action::TakeView, action::TurnTo, action::WaitForFlip, action::CheckPlacement, action::DropPlacement,
                 action::CreateJobs, action::StartJob, action::MoveJob, action::RunJobRequest, action::CheckMovement,
                 action::StoreView, action::FinishPose, action::ResumeJob, action::CloseJob>;

}  // namespace scanrig
