#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/clock.h"
#include "daemon/runtime/actor.h"
#include "daemon/station/events.h"
#include "daemon/station/snapshot.h"
#include "daemon/station/transition.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Receivers of the control loop's decisions. Called from its thread; none may wait.
struct StationPorts {
  std::function<void()> alive = [] {};         ///< called by the running loop, at least four times a second
  std::function<void(const Action&)> perform;  ///< everything but Warn
  std::function<void(const PanelOutputs&)> show;
  /// Stores a latch that was set, changed or cleared. Returns once it is durable, within a third of a second. An error
  /// goes to the log only; the latch holds all the same.
  std::function<void(const std::optional<Latch>&)> store_latch = [](const auto&) {};
  std::function<std::string()> new_job_id;  ///< another one each time
  std::function<bool()> quiet_hours = [] { return false; };
  std::function<std::optional<Error>()> disk_problem = [] { return std::nullopt; };  ///< the job disk does not respond
  /// Calls that hang: their waiting threads cannot report it. `rig_hangs`: of turntable, projector and camera.
  std::function<std::optional<HungCall>()> rig_hangs = [] { return std::nullopt; };
  std::function<std::optional<HungCall>()> panel_hangs = [] { return std::nullopt; };
  std::function<void(const std::shared_ptr<const Snapshot>&)> published = [](const auto&) {};
  std::function<void(const event::Pressed&, const Error& why)> refused_at_panel = [](const auto&, const auto&) {};
};

/// Why the control loop ended.
enum class Ended { shut_down, reload };

struct ControlLoopOptions {
  StationRules rules;
  Clock::Duration warning = std::chrono::seconds(2);  ///< lamp before the first move
  /// A failing device may only lack power: an e-stop that took the power is reported by then (panel_latency()).
  Clock::Duration estop_window = std::chrono::milliseconds(200);
  Clock::Duration stop_retry = std::chrono::seconds(1);      ///< while the table may be moving
  Clock::Duration check_period = std::chrono::seconds(2);    ///< of the devices, in quiet times
  Clock::Duration shutdown_limit = std::chrono::seconds(5);  ///< for confirmation that the rig has stopped
  Clock::Duration hang_limit = std::chrono::seconds(10);     ///< a call that is this late ends the loop
  std::chrono::seconds warm_up{0};                           ///< of the projector: no job starts automatically before
  std::optional<Latch> latch{};                              ///< that an earlier process left
};

/// The thread of the state machine: takes events one by one, decides, hands out actions, publishes a snapshot.
/// Threads: run() has its own; all others may be called from any.
class ControlLoop {
 public:
  using Reply = std::function<void(const Result<std::string>&)>;  ///< the job's id, empty without one

  ControlLoop(Clock& clock, ControlLoopOptions options, JobTable known_jobs);

  void post(Event event) { inbox_.post({std::move(event), {}}); }
  /// The control loop's thread calls `reply` soon; it must not wait. After a shutdown it may never be called.
  /// `offer`, `requester`: as in event::Pressed.
  void press(Button button, Origin origin, Reply reply, std::string offer = {}, std::string requester = {}) {
    inbox_.post({event::Pressed{button, origin, {}, std::move(offer), std::move(requester)}, std::move(reply)});
  }
  /// The same for an engineer's requests.
  void ask(event::MaintenanceRequested what, Reply reply) { inbox_.post({what, std::move(reply)}); }
  /// Queues jobs. `reply` comes when their folders are durable, with the id of the first one. Fails with `not_found`
  /// (the recipe), `invalid_input`, `refused`, `io`.
  void order(JobOrder order, Reply reply) { inbox_.post({event::JobsOrdered{std::move(order)}, std::move(reply)}); }
  /// Does what event::JobRequested lists. `reply` comes when it is done (a bundle: later), with the job's id or the
  /// bundle's path. Fails with `not_found`, `busy`, `refused`, `exists`, `io`.
  void ask(event::JobRequested what, Reply reply) { inbox_.post({std::move(what), std::move(reply)}); }
  /// Ends the loop if the rig is idle, as event::ReloadRequested lists. Fails with `busy`, `refused`.
  void ask(event::ReloadRequested what, Reply reply) { inbox_.post({std::move(what), std::move(reply)}); }
  [[nodiscard]] std::shared_ptr<const Snapshot> snapshot() const { return published_.get(); }
  [[nodiscard]] const StationRules& rules() const { return options_.rules; }  ///< from any thread; they never change

  /// Runs until a Shutdown or a reload is done. Fails with `timeout` when standstill was not confirmed: a new
  /// configuration might address another drive. Fails likewise once a device's call hangs for good: only another
  /// process can use that device again.
  Result<Ended> run(const StationPorts& ports);

 private:
  struct Message {
    Event event;
    Reply reply;
  };

  void handle(Message message, const StationPorts& ports);
  void prepare(Message& message, const StationPorts& ports);
  void answer(Message& message, const Step& step);
  [[nodiscard]] std::string still_doing() const;
  void look_at_the_time(const StationPorts& ports);
  void look_at_the_disk(const StationPorts& ports);
  void look_at_the_panel(const StationPorts& ports);
  void look_at_the_rig(const StationPorts& ports);
  [[nodiscard]] bool is_lost(const HungCall& call) const;
  [[nodiscard]] std::chrono::seconds warm_up_left();
  void carry_out(const Action& action, const StationPorts& ports);
  void wake_later(Event event, Clock::Duration after);
  void blink(const StationPorts& ports);
  void show(const StationPorts& ports);
  void publish(const StationPorts& ports);

  Clock& clock_;
  ControlLoopOptions options_;
  Mailbox<Message> inbox_;
  Published published_;
  // Only for run()'s thread.
  StationState state_;
  JobTable jobs_;
  EventCounter counter_;
  std::uint64_t revision_ = 0;
  RequestId last_request_id_ = 0;
  std::map<RequestId, Reply> waiting_;  // for requests that take longer
  struct Later {
    Clock::TimePoint at;
    Event event;
  };
  std::map<std::size_t, Later> later_;  // by the kind of event: one of a kind, the newest counts
  std::optional<LastOrder> last_order_;
  PanelOutputs shown_;
  bool blink_ = false;
  Clock::TimePoint next_blink_ = Clock::TimePoint::max();
  Clock::TimePoint lamps_tested_ = Clock::TimePoint::min();
  std::optional<Error> lost_;  // why the loop ends without a request
  Clock::TimePoint give_up_ = Clock::TimePoint::max();
  std::optional<Clock::TimePoint> projector_since_;  // when the projector came; nothing: absent
};

}  // namespace scanrig
