#include "drivers/camera/trigger_tracker.h"

#include <algorithm>

namespace scanrig {
namespace {

using std::chrono::nanoseconds;

constexpr double kDrift = 200e-6;  // of a camera's crystal against the host's, with margin
constexpr nanoseconds kJitter = std::chrono::milliseconds(1);

nanoseconds drift_over(nanoseconds span) {
  return nanoseconds(static_cast<std::int64_t>(kDrift * static_cast<double>(std::abs(span.count()))));
}

nanoseconds since_epoch(Clock::TimePoint moment) { return moment.time_since_epoch(); }

}  // namespace

nanoseconds pair_tolerance(nanoseconds since) { return kJitter + 2 * drift_over(since); }

TriggerTracker::TriggerTracker(std::uint64_t id_ring, bool host_clock) : id_ring_(id_ring), host_clock_(host_clock) {
  forget();
}

void TriggerTracker::forget() {
  id_.reset();
  clock_.reset();
  if (host_clock_) clock_ = Offset{nanoseconds(0), nanoseconds(0), nanoseconds(0)};
}

std::optional<Clock::Duration> TriggerTracker::uncertainty() const {
  if (!clock_) return std::nullopt;
  return clock_->high - clock_->low + 4 * kJitter;
}

std::int64_t TriggerTracker::steps_to(std::uint64_t id) const {
  // A camera with ids of 64 bits may use the same protocol: this shows when an id no longer fits the ring.
  if (id_ring_ == 0 || id > id_ring_ || *id_ > id_ring_) return static_cast<std::int64_t>(id - *id_);
  const auto ring = static_cast<std::int64_t>(id_ring_);
  const std::int64_t ahead = (static_cast<std::int64_t>(id) - static_cast<std::int64_t>(*id_) + ring) % ring;
  return ahead > ring / 2 ? ahead - ring : ahead;
}

TriggerTracker::Offset TriggerTracker::offset_at(nanoseconds time) const {
  const nanoseconds slack = host_clock_ ? kJitter : kJitter + drift_over(time - clock_->at);
  return {clock_->low - slack, clock_->high + slack, time};
}

TriggerTracker::Finding TriggerTracker::check(const FrameStamp& frame, const HostWindow& window) const {
  const std::int64_t steps = id_ ? steps_to(frame.id) : 1;
  if (steps <= 0) return Finding::old_frame;
  if (clock_) {
    const Offset offset = offset_at(frame.time);
    if (frame.time <= clock_->at) return Finding::old_frame;
    if (since_epoch(window.begin) - frame.time > offset.high) return Finding::old_frame;
    if (since_epoch(window.end) - frame.time < offset.low) return Finding::clock_jumped;
  }
  return steps > 1 ? Finding::frames_missing : Finding::in_order;
}

void TriggerTracker::accept(const FrameStamp& frame, const HostWindow& window) {
  id_ = frame.id;
  if (host_clock_) {
    clock_->at = frame.time;
    return;
  }
  Offset seen{since_epoch(window.begin) - frame.time, since_epoch(window.end) - frame.time, frame.time};
  if (clock_) {
    const Offset known = offset_at(frame.time);
    seen.low = std::max(seen.low, known.low);
    seen.high = std::max(seen.low, std::min(seen.high, known.high));
  }
  clock_ = seen;
}

Clock::TimePoint TriggerTracker::host_time(const FrameStamp& frame, const HostWindow& window) const {
  if (!clock_) return window.begin;
  const Clock::TimePoint guess{frame.time + (clock_->low + clock_->high) / 2};
  return std::clamp(guess, window.begin, std::max(window.begin, window.end));
}

}  // namespace scanrig
