#include "daemon/rig/outside_stop.h"

#include <utility>

#include "daemon/runtime/actor.h"

namespace scanrig {

OutsideStop::~OutsideStop() {
  if (thread_.joinable()) thread_.join();
}

void OutsideStop::begin() {
  {
    const std::lock_guard guard(mutex_);
    if (std::exchange(is_under_way_, true)) return;
  }
  if (thread_.joinable()) thread_.join();  // it has reported already
  thread_ = start_actor(clock_, [this] { run(); });
}

void OutsideStop::run() {
  const auto stopped = stop_();
  {
    const std::lock_guard guard(mutex_);
    is_under_way_ = false;
  }
  if (!stopped) return report_(event::StopFailed{stopped.error()});
  // The projector's own thread turns it off by its stop, which waits behind the turntable.
  report_(event::Stopped{Error{ErrorCode::timeout, "projector: not confirmed dark, the turntable hangs"}});
}

}  // namespace scanrig
