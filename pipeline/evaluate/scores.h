#pragma once

#include <cstddef>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/evaluate/sigma_figures.h"

namespace scanrig {

inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

/// Distances of points spread evenly over a surface to another surface, mm; NaN where the surface has no area.
struct DistanceFigures {
  double area_mm2 = 0.0;
  double median = kNoFigure;
  double p95 = kNoFigure;
  double share_over_025 = kNoFigure;
  double share_over_050 = kNoFigure;
};

/// Shares are of area, 0..1. pipeline/evaluate/README.md.
struct Scores {
  // In the absolute frame: no alignment.
  DistanceFigures measured;        ///< A, C: measured area to truth
  double observable_share = 0.0;   ///< of the truth
  double covered_010 = kNoFigure;  ///< B: observable truth within 0.10 mm of measured area
  double covered_015 = kNoFigure;
  DistanceFigures closed;                ///< D: closed area to the ideal carve
  double closed_share = 0.0;             ///< E: of the model, beside 1 - observable_share
  DistanceFigures whole;                 ///< all area to truth
  double normal_median_deg = kNoFigure;  ///< measured area's normals against the truth's
  double normal_p95_deg = kNoFigure;
  double flipped_share = kNoFigure;  ///< more than 90 degrees off

  /// Of measured area after the best rigid motion onto the truth.
  DistanceFigures aligned;
  double frame_height_mm = 0.0;  ///< of the calibration's origin above the truth's; taken out, see frame_height.h
  double alignment_deg = 0.0;
  double alignment_mm = 0.0;  ///< at the object's centre

  /// Honesty of sigma: median of abs(error) / sigma in units of what a normal distribution gives (1 is honest, more is
  /// optimism), and the shares beyond 2 and 3 sigma (0.046 and 0.003 would be normal). NaN without sigma.
  double sigma_ratio = kNoFigure;
  double beyond_2_sigma = kNoFigure;
  double beyond_3_sigma = kNoFigure;
  std::vector<SigmaClass> sigma_classes;  ///< the same after the best rigid motion, by class; empty without sigma

  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::size_t components = 0;
  bool watertight = false;
  long genus = 0;
  std::optional<long> true_genus;      ///< of a watertight truth mesh; an open one has none
  std::size_t self_intersections = 0;  ///< faces that cross another

  struct PoseError {
    double deg = 0.0;
    double mm = 0.0;  ///< at the object's centre
    /// The largest of the six principal directions of rotation and translation, in the model's own sigma there.
    double sigmas = kNoFigure;
  };
  std::optional<PoseError> pose2;  ///< of the model's pose1_from_pose2
  struct FurtherPose {
    std::size_t pose = 2;  ///< from 0
    PoseError error;
  };
  std::vector<FurtherPose> further_poses;  ///< of three or more

  struct TextureFigures {
    std::size_t patches = 0;
    double median_px = kNoFigure;  ///< offset of patches of the rendered model in the plain photos
    double p95_px = kNoFigure;
  };
  std::optional<TextureFigures> texture;
};

/// A figure with a limit.
struct Gate {
  std::string name;
  double limit = 0.0;
  double measured = kNoFigure;
  bool at_most = true;  ///< or at least
  [[nodiscard]] bool ok() const { return at_most ? measured <= limit : measured >= limit; }
};

/// The gates A, B, C and E, pose 2 and further ones, topology and texture, as far as there are figures.
std::vector<Gate> gates(const Scores& scores);

nlohmann::json to_json(const Scores& scores);
/// For a terminal: lines of at most 80 characters.
std::string to_table(const Scores& scores);

}  // namespace scanrig
