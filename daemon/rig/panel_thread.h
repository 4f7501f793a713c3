#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "daemon/runtime/busy_timer.h"
#include "daemon/station/events.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// What the change of the panel's inputs means: buttons count when they go down.
std::vector<Event> changes(const PanelInputs& before, const PanelInputs& after);

/// The owner of the panel: reports its inputs, shows what it is told.
class PanelThread {
 public:
  /// `on_estop` is called first, before anybody is told, and must not wait.
  PanelThread(Panel& panel, Clock& clock, std::function<void(Event)> post_event, std::function<void()> on_estop);
  ~PanelThread();
  PanelThread(const PanelThread&) = delete;
  PanelThread& operator=(const PanelThread&) = delete;

  /// Lamps for the panel; shown within the polling period. Does not wait.
  void show(const PanelOutputs& outputs);
  /// What is wrong with a panel that lets its owner wait far beyond every deadline: whoever looks must say so, the
  /// owner cannot. From any thread.
  [[nodiscard]] std::optional<Error> hangs() const;

 private:
  void run();
  Result<void> look();
  Result<void> show_wanted();
  Result<void> read_inputs();

  Panel& panel_;
  Clock& clock_;
  std::function<void(Event)> post_event_;
  std::function<void()> on_estop_;
  BusyTimer busy_timer_;  ///< on the panel
  std::mutex mutex_;
  std::condition_variable changed_;
  PanelOutputs wanted_;
  bool stop_ = false;
  // Of the thread only.
  std::optional<PanelOutputs> shown_;
  std::optional<PanelInputs> known_;
  std::thread thread_;
};

}  // namespace scanrig
