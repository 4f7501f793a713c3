#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "core/result.h"

namespace scanrig {

/// An end of a measured length, on the model's surface.
struct RulerEnd {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< mm, the model's frame
  bool is_measured = false;                         ///< false: closed there by silhouettes or the table
  double sigma_mm = 0.0;                            ///< along the surface's normal; NaN where it is not measured
};

struct ModelLength {
  double mm = 0.0;
  RulerEnd from, to;
  /// U for k = 2, after GUM: sigma of both ends along the line, the calibration's sigma of a point at both ends, and
  /// that of its scale. Nothing: an end is not measured, or the calibration does not say.
  std::optional<double> expanded_uncertainty_mm;
};

/// Lengths on the models of finished jobs: on the whole mesh, not the reduced one of a browser. Keeps the model that it
/// measured last. Threads: any; one measures, others wait.
class ModelRuler {
 public:
  static constexpr double kReachMm = 2.0;  ///< from the surface: the reduced mesh is nearer than that

  /// `job_folder` has model/model.ply and calibration.json; both points in mm in the model's frame. Fails with
  /// `not_found` (no model), `invalid_input` (a point that is not at the surface), `io`.
  Result<ModelLength> measure(const std::filesystem::path& job_folder, const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to);

 private:
  struct Model;
  Result<std::shared_ptr<const Model>> open(const std::filesystem::path& job_folder);

  std::mutex mutex_;
  std::shared_ptr<const Model> last_;  // guarded by mutex_
};

}  // namespace scanrig
