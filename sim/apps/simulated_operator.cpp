#include "sim/apps/simulated_operator.h"

#include <utility>

namespace scanrig::sim {
namespace {

constexpr auto kGlance = std::chrono::milliseconds(200);

}  // namespace

void Operator::run(const std::stop_token& stop) {
  const Clock::Actor actor(clock_);
  while (!stop.stop_requested()) {
    look(rig_.lamps());
    clock_.sleep_for(kGlance);
  }
}

void Operator::look(const PanelOutputs& lamps) {
  const int placement = awaited_placement_;
  const bool is_asked = lamps.flip_request || (placement != 0 && lamps.start_lamp);
  if (is_asked && !was_asked_) {
    rig_.put_board(placement);
    if (placement == 0) rig_.turn_over();
    rig_.press_start();
  } else if (role_ == Role::alone && lamps.start_lamp && !lamps.flip_request && !has_started_) {
    has_started_ = true;
    rig_.press_start();
  } else if ((lamps.amber || lamps.red) && !lamps.busy && !lamps.start_lamp) {
    reset();
  }
  if (lamps.start_lamp && !is_asked && !calibrates_) rig_.put_board(0);
  was_asked_ = is_asked;
}

void Operator::reset() {
  if (role_ == Role::alone && std::exchange(has_reset_, true)) return;
  rig_.lose_frames(0);
  rig_.stall_turntable(false);
  rig_.set_estop(true);
  rig_.set_guard(true);
  rig_.press_reset();
}

}  // namespace scanrig::sim
