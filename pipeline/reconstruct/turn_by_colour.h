#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/registration/refine_pose.h"
#include "pipeline/texture/texture.h"

/// Which of several motions that the shape leaves open is the right one, by the colours that both poses show.
namespace scanrig {

/// A place of one pose's surface and its paint.
struct PaintedPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< mm, the pose's frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, outward
  Eigen::Vector3f bgr = Eigen::Vector3f::Zero();     ///< linear, the rig's light taken out
};

/// Paint of the measured vertices of a pose's partial model that its photographs show. `photos`: placed in the pose's
/// frame. Same bits for any number of threads. Fails with `stopped`.
Result<std::vector<PaintedPoint>> paint_of(const Mesh& partial, std::span<const Photo> photos, const Context& context);

struct ColourOptions {
  double cell = 0.012;           ///< width of the cells over which paint is averaged, as a share of the object's size
  double coarse_cell = 0.04;     ///< the same, for the search
  double coarse_step_deg = 4.0;  ///< of the search about an axis
  double ball_step_deg = 15.0;   ///< of the search over all turns of a ball
  double finest_step_deg = 0.1;  ///< ends the refinement of a free turn
  double apart_deg = 15.0;       ///< motions closer than this are one
  double patch = 0.08;           ///< width of the patches that vote, as a share of the object's size
  double min_shared = 0.3;       ///< a motion shares at least this part of the surface that the one with most shares
  std::size_t min_cells = 60;    ///< painted alike in both poses, fewer decide nothing
  double min_contrast = 0.02;    ///< of the paint, natural logarithm: less is noise and gloss
  double min_correlation = 0.35;
  double min_confidence = 5.0;  ///< standard deviations between the best motion and the next
  float darkest = 0.004F;       ///< of full scale: darker paint is as dark
};

/// Verdict of the colours.
struct ColourDecision {
  bool is_decided = false;  ///< else the colours show nothing, and `pose1_from_pose2` is the first motion given
  Transform pose1_from_pose2 = Transform::Identity();
  double correlation = 0.0;  ///< of both poses' paint under the best motion
  double next = 0.0;         ///< the same under the best other one
  double confidence = 0.0;   ///< standard deviations between the two, over patches of the surface
  double contrast = 0.0;     ///< of the paint: standard deviation of its natural logarithm
};

/// Scores `motions`, and all `free` turns of them, by the correlation of both poses' paint; gains and offsets of either
/// pose, and what varies with height and slope alone, do not count. `free`: none, one axis, or three of a ball. Same
/// bits for any number of threads.
ColourDecision turn_by_colour(std::span<const PaintedPoint> pose1, std::span<const PaintedPoint> pose2,
                              std::span<const Transform> motions, std::span<const FreeTurn> free,
                              const ColourOptions& options = {});

}  // namespace scanrig
