#include "drivers/camera/sensor_camera.h"

#include <algorithm>

#include "drivers/camera/image_memory.h"
#include "drivers/camera/image_quality.h"

namespace scanrig {
namespace {

using Finding = TriggerTracker::Finding;

constexpr int kWarmUpTries = 4;
// A running sensor applies a new exposure to the second or third frame after it; assumed of 15 frames a second.
constexpr auto kExposureLag = std::chrono::milliseconds(200);
constexpr const char* kRedo = "repeat the exposure, and if this goes on check the cable and the load on the line";

double milliseconds(std::chrono::nanoseconds time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

SensorCamera::SensorCamera(std::vector<std::unique_ptr<Sensor>> sensors, const TriggeringOptions& options, Clock& clock)
    : options_(options), clock_(clock) {
  for (auto& sensor : sensors) {
    const TriggerTracker ledger(sensor->id_ring(), sensor->shares_host_clock());
    channels_.push_back({std::move(sensor), ledger});
  }
}

Result<void> SensorCamera::prepare(Deadline deadline) {
  if (auto connected = connect(deadline); !connected || armed_) return connected;
  return get_in_step(deadline);
}

Result<void> SensorCamera::arm(Deadline deadline) {
  if (std::exchange(armed_, false)) in_step_ = false;  // an exposure given up; its frames may still arrive
  if (auto connected = connect(deadline); !connected) return connected;
  for (Channel& channel : channels_) {
    if (auto thrown = throw_away(channel, clock_.now()); !thrown) return thrown;
  }
  if (auto in_step = get_in_step(deadline); !in_step) return in_step;
  for (Channel& channel : channels_) {
    if (auto listens = listen(channel); !listens) return listens;
  }
  armed_ = true;
  trigger_after_ = clock_.now();
  return {};
}

Result<void> SensorCamera::scale_exposure(double factor, Deadline deadline) {
  for (Channel& channel : channels_) {
    if (auto scaled = channel.sensor->scale_exposure(factor, deadline); !scaled) return scaled;
  }
  if (options_.by == TriggeringOptions::By::free_run) exposure_settled_ = clock_.now() + kExposureLag;
  return {};
}

Result<void> SensorCamera::connect(Deadline deadline) {
  for (Channel& channel : channels_) {
    if (auto connected = connect(channel, deadline); !connected) return connected;
  }
  return {};
}

Result<void> SensorCamera::connect(Channel& channel, Deadline deadline) {
  const auto connected_anew = channel.sensor->prepare(deadline);
  if (!connected_anew) return pass_on(connected_anew);
  if (*connected_anew) {
    if (channel.ledger.knows_clock()) ++counts_.returns;
    forget(channel);
  }
  return {};
}

/// The sensor's clock may have restarted, so neither it nor the pair's common time is known.
void SensorCamera::forget(Channel& channel) {
  channel.ledger.forget();
  channel.warm = false;
  last_pair_.reset();
  refused_pair_.reset();
}

/// Discards unexpected frames: of a false edge, or of an exposure given up.
Result<void> SensorCamera::throw_away(Channel& channel, Clock::TimePoint until) {
  for (;;) {
    const auto stray = channel.sensor->next({until});
    if (!stray) return pass_on(stray);
    if (!*stray) return {};
    if (options_.by == TriggeringOptions::By::free_run) continue;
    ++counts_.strays;
    in_step_ = false;
  }
}

/// Does nothing while good exposures follow each other.
Result<void> SensorCamera::get_in_step(Deadline deadline) {
  const bool all = !in_step_ || clock_.now() - last_in_step_ > options_.idle_refresh;
  for (Channel& channel : channels_) {
    if (!all && channel.warm) continue;
    in_step_ = false;
    if (auto warm = warm_up(channel, deadline); !warm) return warm;
    channel.warm = true;
    last_in_step_ = clock_.now();
  }
  in_step_ = true;
  return {};
}

Result<void> SensorCamera::warm_up(Channel& channel, Deadline deadline) {
  if (options_.by == TriggeringOptions::By::free_run) return {};
  const bool can_trigger = channel.sensor->can_trigger();
  if (can_trigger) {
    if (auto deaf = select_source(channel, false); !deaf) return deaf;
  }
  // Long enough for the clocks to distinguish earlier exposures from later ones.
  const auto gap = can_trigger ? channel.ledger.uncertainty().value_or(options_.frame_timeout / 2)
                               : Clock::Duration(options_.frame_timeout / 2);
  if (deadline.left(clock_) < gap) {
    return fail(ErrorCode::timeout, "{}: no time before the deadline to begin counting anew", channel.sensor->name());
  }
  if (auto quiet = throw_away(channel, clock_.now() + gap); !quiet) return quiet;
  if (!can_trigger) {
    channel.ledger.forget_id();
    return {};
  }
  // A new clock is unknown: only a second exposure proves that the first frame was not an earlier one.
  int wanted = channel.ledger.knows_clock() ? 1 : 2;
  for (int i = 0; i < kWarmUpTries && wanted > 0; ++i) {
    ++counts_.warm_up;
    const auto exposed = expose_once(channel, deadline);
    if (!exposed) return pass_on(exposed);
    if (*exposed) --wanted;
  }
  if (wanted > 0) {
    forget(channel);
    return fail(ErrorCode::protocol, "{}: {} exposures for warming up gave no frame in order; check cable and load",
                channel.sensor->name(), kWarmUpTries);
  }
  return listen(channel);
}

/// Returns to the projector's edge, after exposures by software.
Result<void> SensorCamera::listen(Channel& channel) {
  if (!channel.sensor->can_trigger()) return {};
  return select_source(channel, options_.by == TriggeringOptions::By::line);
}

Result<void> SensorCamera::select_source(Channel& channel, bool line) {
  const auto interrupted = channel.sensor->listen_to_line(line);
  if (!interrupted) return pass_on(interrupted);
  if (*interrupted) channel.ledger.forget_id();
  return {};
}

/// Makes one exposure by software. Returns nothing if its frame was torn or did not come; the next one may succeed.
Result<std::optional<SensorFrame>> SensorCamera::expose_once(Channel& channel, Deadline deadline) {
  const auto begin = clock_.now();
  if (auto triggered = channel.sensor->trigger(); !triggered) return pass_on(triggered);
  const Deadline limit = deadline.at_most(clock_, options_.frame_timeout);
  for (;;) {
    auto frame = channel.sensor->next(limit);
    if (!frame) return pass_on(frame);
    if (!*frame) {
      if (deadline.expired(clock_)) {
        return fail(ErrorCode::timeout, "{}: no frame before the deadline although it was told to expose",
                    channel.sensor->name());
      }
      return std::nullopt;
    }
    if (!(*frame)->damage.empty()) return std::nullopt;
    const HostWindow window{begin, (*frame)->arrival};
    const auto finding = channel.ledger.check((*frame)->stamp, window);
    if (finding == Finding::old_frame) continue;  // of an exposure given up; the right one is still to come
    if (finding == Finding::clock_jumped) forget(channel);
    channel.ledger.accept((*frame)->stamp, window);
    if (finding == Finding::clock_jumped) return std::nullopt;
    return frame;
  }
}

Result<StereoFrame> SensorCamera::collect(Deadline deadline) {
  if (!std::exchange(armed_, false)) {
    return fail(ErrorCode::protocol, "camera: nothing to collect, it was not armed");
  }
  in_step_ = options_.by == TriggeringOptions::By::free_run;
  if (options_.by != TriggeringOptions::By::line) trigger_after_ = std::max(clock_.now(), exposure_settled_);
  if (options_.by == TriggeringOptions::By::software) {
    for (Channel& channel : channels_) {
      if (auto triggered = channel.sensor->trigger(); !triggered) return pass_on(triggered);
    }
  }
  auto frames = take_all(deadline.at_most(clock_, options_.frame_timeout));
  if (!frames) return pass_on(frames);
  if (auto together = expect_one_moment(*frames); !together) return pass_on(together);
  in_step_ = true;
  last_in_step_ = clock_.now();
  ++counts_.pairs;
  return hand_out(*frames);
}

Result<StereoFrame> SensorCamera::capture_preview(Deadline deadline) {
  const bool running = options_.by == TriggeringOptions::By::free_run;
  if (std::exchange(armed_, false)) in_step_ = running;  // its frames may still arrive
  if (auto connected = connect(deadline); !connected) return pass_on(connected);
  for (const Channel& channel : channels_) {
    if (running || channel.sensor->can_trigger()) continue;
    return fail(ErrorCode::unsupported, "{}: exposes at an edge of its trigger input only", channel.sensor->name());
  }
  const bool in_step = std::exchange(in_step_, false) || running;  // false until the exposure has succeeded
  trigger_after_ = clock_.now();
  std::vector<SensorFrame> frames;
  for (Channel& channel : channels_) {
    auto frame = running ? take_running(channel, deadline.at_most(clock_, options_.frame_timeout))
                         : expose_by_software(channel, deadline);
    if (!frame) return pass_on(frame);
    frames.push_back(std::move(*frame));
  }
  in_step_ = in_step;
  if (in_step_) last_in_step_ = clock_.now();
  return hand_out(frames);
}

Result<SensorFrame> SensorCamera::expose_by_software(Channel& channel, Deadline deadline) {
  if (!channel.ledger.knows_clock()) {
    if (auto warm = warm_up(channel, deadline); !warm) return pass_on(warm);
  }
  if (auto deaf = select_source(channel, false); !deaf) return pass_on(deaf);
  for (int i = 0; i < kWarmUpTries; ++i) {
    auto frame = expose_once(channel, deadline);
    if (!frame) return pass_on(frame);
    if (*frame) return std::move(**frame);
  }
  return fail(ErrorCode::protocol, "{}: {} exposures gave no whole frame; check cable and load", channel.sensor->name(),
              kWarmUpTries);
}

Result<std::vector<SensorFrame>> SensorCamera::take_all(Deadline deadline) {
  const bool running = options_.by == TriggeringOptions::By::free_run;
  std::vector<SensorFrame> frames;
  for (Channel& channel : channels_) {
    auto frame = running ? take_running(channel, deadline) : take(channel, deadline);
    if (!frame) return pass_on(frame);
    frames.push_back(std::move(*frame));
  }
  if (running) return frames;
  for (Channel& channel : channels_) {
    if (auto alone = expect_no_more(channel); !alone) return pass_on(alone);
  }
  return frames;
}

Result<SensorFrame> SensorCamera::take(Channel& channel, Deadline deadline) {
  const std::string& who = channel.sensor->name();
  auto next = channel.sensor->next(deadline);
  if (!next) return pass_on(next);
  if (!*next) {
    ++counts_.lost;
    return fail(ErrorCode::timeout, "{}: no frame in time, lost or late; {}", who, kRedo);
  }
  SensorFrame& frame = **next;
  if (!frame.damage.empty()) {
    ++counts_.torn;
    return fail(ErrorCode::protocol, "{}: frame {} is torn ({}); {}", who, frame.stamp.id, frame.damage, kRedo);
  }
  const HostWindow window{trigger_after_, frame.arrival};
  switch (channel.ledger.check(frame.stamp, window)) {
    case Finding::in_order: break;
    case Finding::old_frame:
      ++counts_.old;
      return fail(ErrorCode::protocol, "{}: frame {} is older than its trigger; {}", who, frame.stamp.id, kRedo);
    case Finding::frames_missing:
      ++counts_.odd;
      return fail(ErrorCode::protocol, "{}: frames before frame {} are missing, or there was more than one trigger; {}",
                  who, frame.stamp.id, kRedo);
    case Finding::clock_jumped:
      ++counts_.odd;
      forget(channel);
      return fail(ErrorCode::protocol, "{}: its clock was set, frame {} cannot be placed in time; {}", who,
                  frame.stamp.id, kRedo);
  }
  channel.ledger.accept(frame.stamp, window);
  return std::move(frame);
}

/// Frames never stop: those that started before the request are skipped, damaged ones too.
Result<SensorFrame> SensorCamera::take_running(Channel& channel, Deadline deadline) {
  for (;;) {
    auto next = channel.sensor->next(deadline);
    if (!next) return pass_on(next);
    if (!*next) {
      ++counts_.lost;
      return fail(ErrorCode::timeout, "{}: no frame in time; {}", channel.sensor->name(), kRedo);
    }
    if ((*next)->stamp.time < trigger_after_.time_since_epoch() || !(*next)->damage.empty()) continue;
    return std::move(**next);
  }
}

Result<void> SensorCamera::expect_no_more(Channel& channel) {
  const auto more = channel.sensor->next({clock_.now()});
  if (!more) return pass_on(more);
  if (!*more) return {};
  ++counts_.odd;
  return fail(ErrorCode::protocol, "{}: more frames than triggers; {}", channel.sensor->name(), kRedo);
}

std::chrono::nanoseconds SensorCamera::Moments::apart_since(const Moments& before) const {
  return (left - before.left) - (right - before.right);
}

bool SensorCamera::Moments::agrees_with(const Moments& before) const {
  return std::chrono::abs(apart_since(before)) <= pair_tolerance(left - before.left);
}

/// A wrong stamp may belong to the previous pair, which was the first and compared with none. So a pair is good if it
/// agrees with the pair rejected last or with the pair accepted last.
Result<void> SensorCamera::expect_one_moment(const std::vector<SensorFrame>& frames) {
  // Without a common edge there is no common moment: the light stays on, and the table is stopped.
  if (frames.size() < 2 || options_.by != TriggeringOptions::By::line) return {};
  const Moments now{frames[0].stamp.time, frames[1].stamp.time};
  std::chrono::nanoseconds apart{0};
  bool together = true;
  if (options_.frame_clock == TriggeringOptions::FrameClock::ptp) {
    apart = now.left - now.right;
    together = std::chrono::abs(apart) <= pair_tolerance(std::chrono::nanoseconds(0));
  } else if (last_pair_) {
    apart = now.apart_since(*last_pair_);
    together = now.agrees_with(*last_pair_) || (refused_pair_ && now.agrees_with(*refused_pair_));
  }
  if (!together) {
    ++counts_.odd;
    refused_pair_ = now;
    return fail(ErrorCode::protocol, "camera: left and right were exposed {:.2f} ms apart; {}", milliseconds(apart),
                kRedo);
  }
  last_pair_ = now;
  refused_pair_.reset();
  return {};
}

StereoFrame SensorCamera::hand_out(std::vector<SensorFrame>& frames) {
  StereoFrame pair;
  const DecodedImage& left = frames.front().decoded;
  pair.format = left.format;
  if (frames.size() == 2) {
    pair.left = left.image;
    pair.right = frames.back().decoded.image;
  } else {
    const int half = left.image.cols / 2;
    pair.left = copy_of(left.image.colRange(0, half));
    pair.right = copy_of(left.image.colRange(half, 2 * half));
  }
  pair.trigger = 1;
  pair.taken = channels_.front().ledger.host_time(frames.front().stamp, {trigger_after_, frames.front().arrival});
  pair.left_evidence = measure(pair.left, pair.format);
  pair.right_evidence = measure(pair.right, pair.format);
  pair.left_right_correlation = left_right_correlation(pair.left, pair.right, pair.format);
  return pair;
}

}  // namespace scanrig
