#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/clock.h"
#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"
#include "sim/devices/table_motion.h"
#include "sim/scene/board_on_table.h"
#include "sim/scene/scene.h"
#include "sim/scene/truth_writer.h"

namespace scanrig::sim {

/// A button springs back once it has been reported: no press is lost, however late the panel is read.
enum class Button { released, pressed, reported };

/// State seen by the cameras at an edge; becomes images when they are collected.
struct Exposure {
  int placement = 0;
  int board = 0;  ///< number of the board's placement; 0: the object is on the table
  double angle_deg = 0.0;
  bool pattern = false;
  double factor = 1.0;  ///< of the cameras' usual duration
  std::uint64_t number = 0;
  std::uint64_t trigger = 0;
  Clock::TimePoint taken;
  Clock::TimePoint arrival;  ///< of the frames at the host
};

/// Shared state of the devices: the scene on the table, and the actions of operator and tests. `mutex` guards
/// everything except `scene` and `board`, which belong to the camera (its const part to all). Code that changes a state
/// that another thread may wait for calls clock.notify_all(changed).
struct SharedState {
  SharedState(std::unique_ptr<Scene> the_scene, Clock& the_clock)
      : clock(the_clock), scene(std::move(the_scene)), board(*scene) {}

  Clock& clock;
  const Clock::TimePoint begun = clock.now();
  const std::unique_ptr<Scene> scene;
  BoardOnTable board;
  std::mutex mutex;
  std::condition_variable changed;

  // Turntable.
  Axis axis;
  bool stalled = false;
  bool stop_requested = false;

  // Projector and cameras.
  bool dark_requested = false;
  bool armed = false;
  std::uint64_t triggers = 0;
  std::uint64_t exposures = 0;
  double exposure_factor = 1.0;
  std::optional<Exposure> in_flight;
  int frames_to_lose = 0;

  // Panel.
  Button start = Button::released;
  Button stop = Button::released;
  Button reset = Button::released;
  bool estop_ok = true;
  bool guard_closed = true;
  PanelOutputs lamps;

  // On the table.
  ExposureHistory history;
  int board_placement = 0;  ///< number in the plan; 0: the object is on the table

  /// Of the table. Call with `mutex` held.
  [[nodiscard]] double true_angle_deg(Clock::TimePoint at) const;
  /// Of the next exposure. Call with `mutex` held.
  [[nodiscard]] Clock::Duration exposure_time() const;
  /// The trigger edge, at the beginning of an exposure. Call with `mutex` held.
  void edge(Light light);
};

}  // namespace scanrig::sim
