#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "sim/scene/board_renderer.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

/// A printed board that an operator puts on the table of a rig, one placement of the plan after the other, and its
/// images. Threads: one at a time.
class BoardOnTable {
 public:
  static constexpr double kLengthSigmaMm = 0.005;
  /// Print, noise and the operator's errors come from the scene's seed. `scene` must outlive it.
  explicit BoardOnTable(const Scene& scene);

  /// From the first to the last inner corner of the first row, as a person measures it, to kLengthSigmaMm; mm.
  [[nodiscard]] double measured_length_mm() const;
  /// Puts it down as placement `number` (from 1) of the plan, where it faces the cameras at the placement's mark.
  void put(int number);
  /// Left and right image with the table at the true `angle` (radians), in plain light; `exposure` as of Scene.
  StereoImages shoot(double angle, std::uint64_t exposure);

 private:
  const Scene& scene_;
  const DrawnRig rig_;  // as calibrated
  const std::array<CameraModel, 2> cameras_;
  const PrintedBoard board_;
  std::optional<BoardScene> placed_;
  std::array<std::unique_ptr<RayMap>, 2> rays_;  // of the eyes, made once
};

}  // namespace scanrig::sim
