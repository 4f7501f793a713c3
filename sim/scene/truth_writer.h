#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

/// The calibration of a scene's cameras, in the format of docs/reference/scan-folder.md: exact but for a lens residual,
/// for which the format has no place. Fails with `io`.
Result<void> write_calibration(const Scene& scene, const std::filesystem::path& file);

/// True table angles of one pose.
struct PoseTruth {
  int placement = 0;               ///< index into Scene::placements()
  std::vector<double> angles_deg;  ///< one per view
};

/// Placement of the object and table angle of each exposure.
/// Threads: one at a time.
class ExposureHistory {
 public:
  [[nodiscard]] int placement() const { return poses_.back().placement; }
  /// A retaken view, less than half a degree off, replaces the one before.
  void exposed(double angle_deg);
  /// Puts the object down as in the next of the scene's placements; after the last one as in the first.
  void turned_over(const Scene& scene);
  /// Of the scene's number of poses, the latest that were exposed; empty without exposures.
  [[nodiscard]] std::vector<PoseTruth> latest(const Scene& scene) const;

 private:
  std::vector<PoseTruth> poses_ = {{}};  // each time the object was put down
};

/// truth.json, truth.ply and truth_calibration.json into a scan folder, of a drawn rig also rig_truth.json; `poses` in
/// the order they were taken, at least one. Fails with `degenerate` (none), `io`.
Result<void> write_truth(const Scene& scene, const std::vector<PoseTruth>& poses, const std::filesystem::path& folder);

}  // namespace scanrig::sim
