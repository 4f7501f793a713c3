#include "daemon/station/snapshot.h"

#include "core/overloaded.h"

namespace scanrig {

void EventCounter::fault(const Error& error) {
  ++counters_.faults;
  if (error.code == ErrorCode::timeout) ++counters_.deadlines_missed;
}

void EventCounter::see(const Event& event, Clock::TimePoint now) {
  std::visit(
      Overloaded{[&](const event::ViewStored& e) {
                   ++counters_.views_stored;
                   counters_.retakes += e.retake_reasons.size();
                 },
                 [&](const event::MovementChecked& e) { counters_.retakes += e.movement_check.retake_reasons.size(); },
                 [&](const event::StageProgress& e) {
                   const auto since = running_.try_emplace({e.job, e.stage}, now).first;
                   if (e.fraction < 1.0) return;
                   const std::chrono::duration<double> spent = now - since->second;
                   counters_.stage_seconds[e.stage] += spent.count();
                   running_.erase(since);
                 },
                 [&](const event::RigFailed& e) { fault(e.error); },
                 [&](const event::StopFailed& e) { fault(e.error); },
                 [&](const event::PanelFailed& e) {
                   if (e.error.code != ErrorCode::busy) fault(e.error);  // lent to setup is no fault
                 },
                 [&](const event::StoreFailed& e) { fault(e.error); },
                 [&](const event::EstopChanged& e) { counters_.faults += e.ok ? 0 : 1; }, [](const auto&) {}},
      event);
}

void EventCounter::see(const JobEnd& end) {
  ++counters_.jobs_ended[std::string(to_string(end.state))];
  std::erase_if(running_, [&](const auto& stage) { return stage.first.first == end.job; });
}

Standstill standstill(const Snapshot& snapshot) {
  if (snapshot.may_be_moving || snapshot.machine == MachineState::preoperational) return Standstill::unknown;
  switch (snapshot.activity) {
    case Activity::stopping: return Standstill::pending;
    case Activity::homing:
    case Activity::jogging:
    case Activity::scanning: return Standstill::moving;
    default: return Standstill::confirmed;
  }
}

std::string_view to_string(Standstill standstill) {
  switch (standstill) {
    case Standstill::confirmed: return "confirmed";
    case Standstill::pending: return "pending";
    case Standstill::moving: return "moving";
    case Standstill::unknown: break;
  }
  return "unknown";
}

}  // namespace scanrig
