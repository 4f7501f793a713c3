#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Debounces levels, the same way for every panel. A level counts once it has held for kDebounce, a press that
/// starts something once it has held for kMinimumPress; an e-stop or guard that opens counts at once. A button pressed
/// in the first levels is stuck until it is released.
class PanelDebounce {
 public:
  static constexpr std::chrono::milliseconds kDebounce{50};
  static constexpr std::chrono::milliseconds kMinimumPress{100};  ///< of Start and Reset

  explicit PanelDebounce(const std::vector<bool PanelInputs::*>& fields);

  /// `levels` in the order of the fields; true has the meaning of the field's name.
  void take(const std::vector<bool>& levels, Clock::TimePoint now);

  /// Debounced inputs. Unwired inputs have their rest value; a stuck button is not pressed.
  [[nodiscard]] PanelInputs settled() const;
  /// Time when a level that has not counted yet will count, unless it changes.
  [[nodiscard]] std::optional<Clock::TimePoint> due() const;
  /// Fails with `device_alarm` while a button is stuck; the error names it.
  [[nodiscard]] Result<void> none_stuck() const;

 private:
  struct Input {
    bool PanelInputs::*field;
    bool level = false;    // present level
    bool settled = false;  // level that counts
    bool stuck = false;
    Clock::TimePoint since{};
  };

  std::vector<Input> inputs_;
  bool first_ = true;
};

}  // namespace scanrig
