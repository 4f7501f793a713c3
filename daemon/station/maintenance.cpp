#include <cmath>

#include "daemon/station/step_builder.h"

namespace scanrig {
namespace {

using What = event::MaintenanceRequested::What;

void begin(StepBuilder& m) {
  auto& s = m.s();
  if (s.machine == MachineState::maintenance) return m.refuse(ErrorCode::refused, "Maintenance mode is already on.");
  const bool idle =
      s.machine == MachineState::halted || s.machine == MachineState::error || s.machine == MachineState::ready;
  if (!idle || s.activity != Activity::none || s.may_be_moving || s.unclassified) {
    return m.refuse(ErrorCode::busy, "The rig is busy ({}, {}). Try again when idle.", to_string(s.machine),
                    to_string(s.activity));
  }
  s.maintenance = Maintenance{.before = s.machine, .homed = s.machine == MachineState::ready};
  s.auto_home_allowed = false;
  m.enter(MachineState::maintenance, "Maintenance was requested.");
}

/// Only who found the table homed and has moved nothing may go on scanning.
void end(StepBuilder& m) {
  auto& s = m.s();
  const auto& was = *s.maintenance;
  const bool still_ready = was.before == MachineState::ready && !was.moved;
  const auto next = s.latch ? MachineState::error : still_ready ? MachineState::ready : MachineState::halted;
  s.maintenance.reset();
  m.enter(next, s.latch ? s.latch->cause : "Maintenance has ended.");
}

/// Whoever lets the table move in maintenance stands at the panel, or there is a guard between him and the table.
void jog(StepBuilder& m, const event::MaintenanceRequested& asked) {
  auto& maintenance = *m.s().maintenance;
  if (!m.require_safe()) return;
  if (!m.rules().guard && !maintenance.consent) {
    return m.refuse(ErrorCode::refused, "No guard: press Reset at the panel first.");
  }
  if (!maintenance.homed) return m.refuse(ErrorCode::not_homed, "The table is not homed. Press Reset first.");
  if (!std::isfinite(asked.angle.value) || !(asked.speed.value > 0) || asked.speed > kMaxJogSpeed) {
    return m.refuse(ErrorCode::out_of_range, "A jog is an angle and a speed of more than 0 and at most {} deg/s.",
                    kMaxJogSpeed.value);
  }
  maintenance.jog = action::Jog{asked.angle, asked.relative, asked.speed};
  m.warn();
}

}  // namespace

void ask_maintenance(StepBuilder& m, const event::MaintenanceRequested& asked) {
  if (m.s().shutting_down) return m.refuse(ErrorCode::refused, "The service is shutting down.");
  if (asked.what == What::on) return begin(m);
  if (!m.s().maintenance) return m.refuse(ErrorCode::refused, "Maintenance mode is off. Switch it on first.");
  if (m.s().activity != Activity::none) {
    return m.refuse(ErrorCode::busy, "The rig is busy ({}): wait or press Stop.", to_string(m.s().activity));
  }
  switch (asked.what) {
    case What::on: break;  // above
    case What::off: return end(m);
    case What::home: return reset_in_maintenance(m, Origin::remote);
    case What::jog: return jog(m, asked);
    case What::pulse: m.s().activity = Activity::pulsing; return m.act(action::Pulse{});
    case What::lamp_test: return m.act(action::TestLamps{});
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

}  // namespace scanrig
