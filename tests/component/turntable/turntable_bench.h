#pragma once

#include <chrono>
#include <functional>

#include "core/clock.h"
#include "drivers/turntable/turntable.h"

namespace scanrig {

/// A turntable on the bench, with what an onlooker sees of it. See turntable_compliance.h.
class TurntableBench {
 public:
  virtual ~TurntableBench() = default;
  virtual Turntable& turntable() = 0;
  virtual Clock& clock() = 0;

  /// The table's angle as an onlooker sees it, counter-clockwise; its zero is arbitrary but fixed.
  virtual double seen_deg() = 0;
  virtual bool seen_moving() = 0;
  /// True if the device measures the table's position; if not, a move does not detect a table that is blocked.
  virtual bool has_feedback() { return true; }
  /// True if the bench can block the table; otherwise no operator does it. block() blocks or releases it.
  virtual bool can_block() { return true; }
  virtual void block(bool blocked) = 0;
  /// Runs `act`, once, from another thread, as soon as the table is seen moving; ends when the bench is destroyed.
  virtual void when_moving(std::function<void()> act) = 0;
  /// Time in which home() and any move end with margin, and one that is over before a quarter turn is.
  virtual Clock::Duration ample() { return std::chrono::seconds(10); }
  virtual Clock::Duration too_short() = 0;
  virtual Degrees tolerance() = 0;
};

}  // namespace scanrig
