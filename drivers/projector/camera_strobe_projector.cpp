#include "drivers/projector/camera_strobe_projector.h"

namespace scanrig {
namespace {

/// To switch the outputs off; more than one repetition of a request (0.5 s). A camera that is gone must not keep a stop
/// waiting. A fire() keeps this much of its time.
constexpr auto kOffTime = std::chrono::milliseconds(700);

}  // namespace

Result<void> CameraStrobeProjector::fire(Light light, Deadline deadline) {
  const std::string& output = light == Light::pattern ? options_.pattern_output : options_.plain_output;
  {
    const std::scoped_lock lock(mutex_);
    off_requested_ = false;
  }
  const Deadline work{deadline.at - kOffTime};
  if (auto time = expect_time(work); !time) return pass_on(time, "projector");
  const auto exposed = expose(output, work);
  const auto off = turn_off(deadline);
  if (!exposed) return pass_on(exposed, "projector");
  return off;
}

Result<void> CameraStrobeProjector::expose(const std::string& output, Deadline deadline) {
  if (auto selected = strobe_.select_output(output, deadline); !selected) return selected;
  const auto went_off = [] { return fail(ErrorCode::io, "went dark on request before the exposure was over"); };
  {
    const std::scoped_lock lock(mutex_);
    if (off_requested_) return went_off();
  }
  if (auto time = expect_time(deadline); !time) return time;
  if (auto started = strobe_.start_exposure(deadline); !started) return started;
  std::unique_lock lock(mutex_);
  const auto end = clock_.now() + options_.trigger_delay + options_.exposure;
  if (clock_.wait_until(lock, wake_, end, [&] { return off_requested_; })) return went_off();
  return {};
}

Result<void> CameraStrobeProjector::expect_time(Deadline deadline) const {
  if (deadline.left(clock_) >= options_.trigger_delay + options_.exposure) return {};
  return fail(ErrorCode::timeout, "an exposure of {} us does not fit before the deadline", options_.exposure.count());
}

Result<void> CameraStrobeProjector::turn_off(Deadline deadline) {
  if (auto off = strobe_.select_output("", deadline.at_most(clock_, kOffTime)); !off)
    return pass_on(off, "projector: the light may be on");
  return {};
}

void CameraStrobeProjector::request_off() noexcept {
  {
    const std::scoped_lock lock(mutex_);
    off_requested_ = true;
  }
  clock_.notify_all(wake_);
}

}  // namespace scanrig
