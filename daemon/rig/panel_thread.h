#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "daemon/rig/devices.h"
#include "daemon/station/events.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Translates changes of the panel's inputs: buttons count when they go down.
std::vector<Event> changes(const PanelInputs& before, const PanelInputs& after);

struct PanelThreadOptions {
  Clock::Duration read_time{0};  ///< time a reading may take beyond its deadline: a module on a bus
  Clock::Duration hang_margin = DeviceWatch::kMargin;  ///< a call that is this late hangs
};

/// Worst time from an input's edge to its event: debouncing, the longest wait of the panel's thread for new
/// lamps, `read_time`.
Clock::Duration panel_latency(Clock::Duration read_time);

/// The owner of the panel: reports its inputs, shows the lamps it is given.
class PanelThread {
 public:
  /// `on_estop` is called first, before any report, and must not wait.
  PanelThread(Panel& panel, Clock& clock, PanelThreadOptions options, std::function<void(Event)> post_event,
              std::function<void()> on_estop);
  ~PanelThread();
  PanelThread(const PanelThread&) = delete;
  PanelThread& operator=(const PanelThread&) = delete;

  /// Lamps for the panel; shown within 20 ms while it shows that the station works, else within 100 ms. Does not wait.
  void show(const PanelOutputs& outputs);
  /// The call of the panel in which this thread hangs. From any thread.
  [[nodiscard]] std::optional<HungCall> hung() const { return panel_.hung(); }

 private:
  void run();
  Result<void> show_wanted();
  Result<void> read_inputs();

  WatchedPanel panel_;
  Clock& clock_;
  std::function<void(Event)> post_event_;
  std::function<void()> on_estop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  PanelOutputs wanted_;
  bool stop_ = false;
  // Only for the thread.
  std::optional<PanelOutputs> shown_;
  std::optional<PanelInputs> known_;
  std::thread thread_;
};

}  // namespace scanrig
