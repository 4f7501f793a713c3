#include <chrono>
#include <cmath>

#include "daemon/station/step_builder.h"

namespace scanrig {
namespace {

using Task = event::MaintenanceRequested::What;

constexpr std::chrono::minutes kConsentTimeout{10};  ///< without a motion

void begin(StepBuilder& m, const std::string& requester) {
  auto& s = m.s();
  if (s.machine == MachineState::maintenance) return m.refuse(ErrorCode::refused, "Maintenance mode is already on.");
  const bool idle =
      s.machine == MachineState::halted || s.machine == MachineState::error || s.machine == MachineState::ready;
  if (!idle || s.activity != Activity::none || s.may_be_moving || s.unclassified) {
    return m.refuse(ErrorCode::busy, "The rig is busy ({}, {}). Try again when idle.", to_string(s.machine),
                    to_string(s.activity));
  }
  s.maintenance = Maintenance{.before = s.machine, .homed = s.machine == MachineState::ready, .requester = requester};
  s.auto_home_allowed = false;
  m.enter(MachineState::maintenance, "Maintenance was requested.");
}

/// Only a requester who found the table homed and has moved nothing may continue scanning.
void end(StepBuilder& m) {
  auto& s = m.s();
  const auto& was = *s.maintenance;
  const bool still_ready = was.before == MachineState::ready && !was.moved;
  const auto next = s.latch ? MachineState::error : still_ready ? MachineState::ready : MachineState::halted;
  s.maintenance.reset();
  m.enter(next, s.latch ? s.latch->cause : "Maintenance has ended.");
}

/// A person who moves the table in maintenance is at the panel, or a guard is between that person and the table.
void jog(StepBuilder& m, const event::MaintenanceRequested& asked) {
  auto& maintenance = *m.s().maintenance;
  if (!m.require_safe()) return;
  if (!maintenance.may_jog(m.rules().guard)) {
    return m.refuse(ErrorCode::refused,
                    "Without a closed guard a jog needs an operator at the panel: press Reset there first.");
  }
  const bool is_by_guard = m.rules().guard && !maintenance.guard_was_opened;
  if (!is_by_guard && asked.requester != maintenance.requester) {
    return m.refuse(ErrorCode::refused,
                    "Consent to jog is for who switched maintenance on: switch it off and on, then press Reset.");
  }
  if (!maintenance.homed) return m.refuse(ErrorCode::not_homed, "The table is not homed. Press Reset first.");
  if (!std::isfinite(asked.angle.value) || !(asked.speed.value > 0) || asked.speed > kMaxJogSpeed) {
    return m.refuse(ErrorCode::out_of_range, "A jog is an angle and a speed of more than 0 and at most {} deg/s.",
                    kMaxJogSpeed.value);
  }
  maintenance.jog = action::Jog{asked.angle, asked.relative, asked.speed};
  m.warn();
}

/// Light is as dangerous as a motion: the same rules apply, except home and consent.
void pulse(StepBuilder& m) {
  if (!m.require_safe()) return;
  m.s().activity = Activity::pulsing;
  m.act(action::Pulse{});
}

/// Ends the control loop, once the rig is seen stopped.
void restart(StepBuilder& m, const char* cause) {
  m.s().shutting_down = m.s().reloading = true;
  m.s().maintenance.reset();
  m.s().machine = MachineState::halted;
  m.s().cause = cause;
  m.stop_rig();
}

/// A reload must not clear a latched fault.
void reload(StepBuilder& m, const std::string& still_doing) {
  constexpr const char* kStays = "The configuration is not reloaded";
  const auto& s = m.s();
  if (m.rules().lent) return m.refuse_lent();
  if (s.shutting_down) return m.refuse(ErrorCode::busy, "{}: the service is ending or reloading.", kStays);
  if (s.machine == MachineState::error) {
    return m.refuse(ErrorCode::refused, "{}: fix the fault, then press Reset at the panel.", kStays);
  }
  const bool idle = s.machine == MachineState::halted || s.machine == MachineState::ready;
  if (!idle || s.activity != Activity::none) {
    return m.refuse(ErrorCode::busy, "{}: the rig is busy ({}, {}). Try again when idle.", kStays, to_string(s.machine),
                    to_string(s.activity));
  }
  if (!m.require_disk()) return;
  if (!still_doing.empty()) return m.refuse(ErrorCode::busy, "{}: {}. Try again later.", kStays, still_doing);
  restart(m, "The configuration is reloaded.");
}

/// A latch stays: the restart finds it again.
void lend(StepBuilder& m, const std::string& still_doing) {
  const auto& s = m.s();
  if (s.shutting_down) {
    return m.refuse(ErrorCode::busy, "The service is ending or restarting. Try again later.");
  }
  if (m.rules().lent) return m.refuse(ErrorCode::busy, "Setup has the devices already.");
  if (!s.maintenance) return m.refuse(ErrorCode::refused, "Setup needs the devices: switch maintenance on first.");
  if (s.activity != Activity::none) {
    return m.refuse(ErrorCode::busy, "The rig is busy ({}): wait or press Stop.", to_string(s.activity));
  }
  if (!m.require_disk()) return;
  if (!still_doing.empty()) return m.refuse(ErrorCode::busy, "Not now: {}. Try again later.", still_doing);
  restart(m, "The devices are lent to setup.");
}

/// Also while Stop is carried out.
void give_back(StepBuilder& m) {
  if (m.s().shutting_down) {
    return m.refuse(ErrorCode::busy, "The service is ending or restarting. Try again later.");
  }
  if (!m.rules().lent) return m.refuse(ErrorCode::refused, "Setup is not running.");
  restart(m, "Setup has ended.");
}

}  // namespace

void ask_maintenance(StepBuilder& m, const event::MaintenanceRequested& asked) {
  if (m.s().shutting_down) return m.refuse(ErrorCode::refused, "The service is shutting down.");
  if (m.rules().lent) return m.refuse_lent();
  if (asked.what == Task::on) return begin(m, asked.requester);
  if (!m.s().maintenance) return m.refuse(ErrorCode::refused, "Maintenance mode is off. Switch it on first.");
  if (m.s().activity != Activity::none) {
    return m.refuse(ErrorCode::busy, "The rig is busy ({}): wait or press Stop.", to_string(m.s().activity));
  }
  switch (asked.what) {
    case Task::on: break;  // above
    case Task::off: return end(m);
    case Task::home: return reset_in_maintenance(m, Origin::remote);
    case Task::jog: return jog(m, asked);
    case Task::pulse: return pulse(m);
    case Task::lamp_test: return m.act(action::TestLamps{});
  }
}

void ask_restart(StepBuilder& m, const event::ReloadRequested& asked) {
  using Why = event::ReloadRequested::Why;
  switch (asked.why) {
    case Why::configuration: return reload(m, asked.still_doing);
    case Why::lend: return lend(m, asked.still_doing);
    case Why::give_back: return give_back(m);
  }
}

void reset_in_maintenance(StepBuilder& m, Origin origin) {
  if (m.s().activity != Activity::none) return m.refuse(ErrorCode::busy, "The rig is {}.", to_string(m.s().activity));
  if (origin == Origin::remote && !m.remote_may_move("homing")) return;
  if (!m.require_safe()) return;
  auto& maintenance = *m.s().maintenance;
  if (origin == Origin::panel) {
    m.s().latch.reset();
    maintenance.consent = true;
    maintenance.guard_was_opened = false;
    m.act(action::EndConsentLater{kConsentTimeout});
  }
  maintenance.jog.reset();
  maintenance.homed = false;
  m.s().cause = "Homing was requested.";
  m.warn();
}

void move_in_maintenance(StepBuilder& m) {
  auto& maintenance = *m.s().maintenance;
  maintenance.moved = true;
  if (maintenance.jog) {
    m.s().activity = Activity::jogging;
    m.act(*maintenance.jog);
  } else {
    m.s().activity = Activity::homing;
    m.act(action::Home{});
  }
}

void moved_in_maintenance(StepBuilder& m) {
  if (m.s().maintenance->consent) m.act(action::EndConsentLater{kConsentTimeout});
}

void consent_timed_out(StepBuilder& m) {
  auto& maintenance = m.s().maintenance;
  if (!maintenance || !maintenance->consent) return;
  if (m.s().activity != Activity::none) return m.act(action::EndConsentLater{kConsentTimeout});
  maintenance->consent = false;
}

void guard_opened_in_maintenance(StepBuilder& m) {
  auto& maintenance = m.s().maintenance;
  if (!maintenance) return;
  maintenance->consent = false;
  maintenance->guard_was_opened = true;
}

}  // namespace scanrig
