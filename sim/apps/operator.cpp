#include "sim/apps/operator.h"

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
  if (lamps.flip_request && !flip_was_requested_) {
    rig_.turn_over();
    rig_.press_start();
  } else if (lamps.start_lamp && !lamps.flip_request && !has_started_) {
    has_started_ = true;
    rig_.press_start();
  } else if (lamps.amber && !lamps.busy && !lamps.start_lamp && !has_reset_) {
    has_reset_ = true;
    rig_.press_reset();
  }
  flip_was_requested_ = lamps.flip_request;
}

}  // namespace scanrig::sim
