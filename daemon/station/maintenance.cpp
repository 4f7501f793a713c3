#include <cmath>

#include "daemon/station/machine.h"

namespace scanrig {
namespace {

using What = event::MaintenanceAsked::What;

void begin(Machine& m) {
  auto& s = m.s();
  if (s.machine == MachineState::maintenance) return m.refuse(ErrorCode::refused, "Maintenance mode is on already.");
  const bool idle =
      s.machine == MachineState::halted || s.machine == MachineState::error || s.machine == MachineState::ready;
  if (!idle || s.activity != Activity::none || s.may_be_moving || s.unnamed) {
    return m.refuse(ErrorCode::busy, "Maintenance begins when the rig is idle: it is {} ({}).", to_string(s.machine),
                    to_string(s.activity));
  }
  s.maintenance = Maintenance{.before = s.machine, .homed = s.machine == MachineState::ready};
  s.home_by_guard = false;
  m.enter(MachineState::maintenance, "Maintenance was asked for.");
}

/// Only who found the table homed and has moved nothing may go on scanning.
void end(Machine& m) {
  auto& s = m.s();
  const auto& was = *s.maintenance;
  const bool still_ready = was.before == MachineState::ready && !was.moved;
  const auto next = s.latched ? MachineState::error : still_ready ? MachineState::ready : MachineState::halted;
  s.maintenance.reset();
  m.enter(next, "Maintenance has ended.");
}

/// Whoever lets the table move in maintenance stands at the panel, or there is a guard between him and the table.
void jog(Machine& m, const event::MaintenanceAsked& asked) {
  auto& maintenance = *m.s().maintenance;
  if (!m.safe_to_move()) return;
  if (!m.rules().guard && !maintenance.consent) {
    return m.refuse(ErrorCode::refused, "Without a guard somebody must stand at the panel: press Reset there first.");
  }
  if (!maintenance.homed) return m.refuse(ErrorCode::not_homed, "The table is not homed: press Reset first.");
  if (!std::isfinite(asked.angle.value) || !(asked.speed.value > 0) || asked.speed > kMaxJogSpeed) {
    return m.refuse(ErrorCode::out_of_range, "A jog is an angle and a speed of more than 0 and at most {} deg/s.",
                    kMaxJogSpeed.value);
  }
  maintenance.jog = action::Jog{asked.angle, asked.relative, asked.speed};
  m.warn();
}

}  // namespace

void ask_maintenance(Machine& m, const event::MaintenanceAsked& asked) {
  if (m.s().shutting_down) return m.refuse(ErrorCode::refused, "The daemon is shutting down.");
  if (asked.what == What::on) return begin(m);
  if (!m.s().maintenance) return m.refuse(ErrorCode::refused, "Maintenance mode is off: switch it on first.");
  if (m.s().activity != Activity::none) {
    return m.refuse(ErrorCode::busy, "The rig is {}: wait, or press Stop.", to_string(m.s().activity));
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

void reset_in_maintenance(Machine& m, Origin origin) {
  if (m.s().activity != Activity::none) return m.refuse(ErrorCode::busy, "The rig is {}.", to_string(m.s().activity));
  if (origin == Origin::remote && !m.remote_may_move("homing")) return;
  if (!m.safe_to_move()) return;
  auto& maintenance = *m.s().maintenance;
  if (origin == Origin::panel) {
    m.s().latched = false;
    maintenance.consent = true;
  }
  maintenance.jog.reset();
  maintenance.homed = false;
  m.s().cause = "Homing was asked for.";
  m.warn();
}

void stop_in_maintenance(Machine& m) {
  if (!m.may_move()) return m.refuse(ErrorCode::refused, "Nothing is moving.");
  m.s().maintenance->homed = false;
  m.s().cause = "Stop was pressed.";
  m.stop_rig();
}

void move_in_maintenance(Machine& m) {
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
