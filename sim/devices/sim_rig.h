#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"
#include "drivers/turntable/turntable.h"
#include "sim/scene/effects.h"
#include "sim/scene/rig_variation.h"

namespace scanrig::sim {

struct SimRigOptions {
  std::filesystem::path object;  ///< OBJ, PLY or GLB; empty: the built-in figurine
  double height_mm =
      100.0;               ///< largest extent of the object: its bounding cylinder, along its longest way, is this high
  std::uint64_t seed = 1;  ///< placements, sensor noise, table errors
  int poses = 2;
  double image_scale = 1.0;      ///< 0.25 gives 320x240 with the same field of view, for fast tests
  bool same_rest_twice = false;  ///< the operator does not turn the object over
  bool noise = true;
  std::optional<RigVariation> rig = std::nullopt;  ///< a drawn rig; nothing: the default rig, without any error
  ChosenProfile profile{};
  int views = 8;  ///< per pose: which of them handling spoils
};

/// The default rig, or a drawn one, in this process: turntable, projector, cameras and panel over one rendered scene.
/// Threads: each device as its interface says; the operator's functions may be called from any thread.
class SimRig {
 public:
  /// Fails with `invalid_input` (the mesh cannot be used, or is larger than the working volume), `not_found`,
  /// `unsupported` (the kind of file), `degenerate` (no two rests to lie on), `out_of_range` (image_scale, poses).
  static Result<std::unique_ptr<SimRig>> create(const SimRigOptions& options, Clock& clock);
  virtual ~SimRig() = default;

  virtual Turntable& turntable() = 0;
  virtual Projector& projector() = 0;
  virtual StereoCamera& camera() = 0;
  virtual Panel& panel() = 0;

  // Actions of the operator at the rig.
  virtual void press_start() = 0;
  virtual void press_stop() = 0;
  virtual void press_reset() = 0;
  virtual void set_estop(bool ok) = 0;
  virtual void set_guard(bool closed) = 0;
  virtual void turn_over() = 0;  ///< puts the object on its next rest
  /// The calibration board as placement `number` (from 1) of the plan, in the object's place; 0 takes it off again.
  virtual void put_board(int number) = 0;
  virtual PanelOutputs lamps() const = 0;

  // Faults, for tests.
  virtual void stall_turntable(bool stalled) = 0;
  virtual void lose_frames(int count) = 0;  ///< the next `count` frame pairs never arrive

  /// The calibration of docs/reference/scan-folder.md, exact but for a drawn rig's lens residual.
  virtual Result<void> write_calibration(const std::filesystem::path& file) const = 0;
  /// truth.json and truth.ply, into a scan folder, for the latest `poses` times the object was put down and exposed; a
  /// retaken view replaces the one before. Fails with `degenerate` (nothing exposed yet), `io`.
  virtual Result<void> write_truth(const std::filesystem::path& folder) const = 0;
  virtual std::string profile_sha256() const = 0;
  /// Of the board's first row of corners: what a person measures, mm, and its standard deviation.
  virtual std::array<double, 2> measured_board_length() const = 0;
  virtual std::array<std::string, 2> camera_serials() const = 0;  ///< left, right
};

}  // namespace scanrig::sim
