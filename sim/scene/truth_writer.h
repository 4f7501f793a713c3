#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

/// The exact calibration of a scene's cameras, as docs/reference/scan-folder.md has it. Fails with `io`.
Result<void> write_calibration(const Scene& scene, const std::filesystem::path& file);

/// Where the table really stood while one pose was taken.
struct PoseTruth {
  int placement = 0;               ///< index into Scene::placements()
  std::vector<double> angles_deg;  ///< one a view
};

/// How the object lay and where the table stood, exposure by exposure.
/// Threads: one at a time.
class ExposureHistory {
 public:
  [[nodiscard]] int placement() const { return poses_.back().placement; }
  /// A view that is taken again, less than half a degree off, replaces the one before.
  void exposed(double angle_deg);
  /// The object is put down as in the next of the scene's placements, after the last one as in the first.
  void turned_over(const Scene& scene);
  /// Of the scene's number of poses, the latest that were exposed; empty if there is none.
  [[nodiscard]] std::vector<PoseTruth> latest(const Scene& scene) const;

 private:
  std::vector<PoseTruth> poses_ = {{}};  // each time the object was put down
};

/// truth.json and truth.ply into a scan folder; `poses` in the order they were taken, at least one. Fails
/// with `degenerate` (none), `io`.
Result<void> write_truth(const Scene& scene, const std::vector<PoseTruth>& poses, const std::filesystem::path& folder);

}  // namespace scanrig::sim
