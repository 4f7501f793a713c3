#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "pipeline/evaluate/true_view.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"

namespace scanrig {

/// Median of the absolute value of a standard normal distribution.
inline constexpr double kNormalMedian = 0.67449;

/// Sigma that the model claims at a sample of its surface; the model has one for every vertex.
double sigma_at(const Mesh& model, const SurfaceSample& sample);

/// Honesty of sigma in one class of points, or of distances between points.
struct SigmaClass {
  std::string name;        ///< "views 2", "incidence 40 to 60 deg", "radius under 5 mm", "distances 20 to 80 mm"
  std::size_t count = 0;   ///< of points or distances; a class without any is left out
  double ratio = 0.0;      ///< median of abs(error) / sigma over that of a normal distribution: 1 is honest
  double within_2 = 0.0;   ///< share within two sigma; 0.954 of a normal distribution
  double median_mm = 0.0;  ///< of abs(error)
};

/// Compares what measured points claim of themselves with their error after the best rigid motion of the whole model,
/// class by class: sigma is of the shape, and the frame of a rig is a convention.
class SigmaProbe {
 public:
  /// `samples`: of measured faces; those without sigma are left out. `truth_from_model`: the best rigid motion.
  /// `surface` is the index of `truth.mesh`. All must outlive the probe.
  SigmaProbe(const Mesh& model, const std::vector<SurfaceSample>& samples, const Truth& truth,
             const SurfaceIndex& surface, const Transform& truth_from_model);

  /// Notes from where the points were seen. Call it with every view of the truth.
  void see(const TrueView& view);

  /// Over all, by the number of views, by the best view's incidence, by the truth's radius of curvature, and of
  /// distances between points 20 to 80 mm apart.
  [[nodiscard]] std::vector<SigmaClass> figures() const;

 private:
  struct Point {
    Eigen::Vector3d model = Eigen::Vector3d::Zero();  ///< the model's point, in the truth's frame
    Eigen::Vector3d truth = Eigen::Vector3d::Zero();  ///< nearest to it
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double sigma = 0.0, radius = 0.0, facing = 0.0;
    int views = 0;  ///< by the model's own account
  };
  [[nodiscard]] SigmaClass distances() const;

  std::vector<Point> points_;
};

}  // namespace scanrig
