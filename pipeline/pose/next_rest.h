#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/pose/rig_sight.h"
#include "pipeline/pose/stable_rests.h"

namespace scanrig {

/// Whether the pose of an object that lies on another rest could be found from what both poses would see.
enum class PoseOutlook {
  findable,
  small_overlap,  ///< too little of the surface would be seen in both poses
  weak            ///< the surface seen in both may turn or slide along itself
};

struct NextRestOptions {
  StableRestOptions stable;
  SightOptions sight;
  std::size_t samples = 3000;  ///< of the unseen surface, and of the measured one
  /// That a view shows the object itself where it shows the surface that bounds it: the object may lie deeper, and
  /// other parts of it hide it. So the more views, the surer. What stands on the table is where the table is.
  double chance_of_a_view = 0.5, chance_on_table = 0.9;
  double on_table_mm = 1.0;      ///< unseen surface that is lower than this bounds what stands on the table
  double same_rest_deg = 15.0;   ///< a rest nearer to the present one is that
  double min_margin_mm = 0.0;    ///< between the centre of mass and the support's edge: else it tips over
  double min_overlap = 0.15;     ///< twice the least share that `estimate_pose` confirms, and some
  double min_stiffness = 0.004;  ///< see NextRest::stiffness
};

/// One other stable rest of an object, with what a scan on it is expected to bring. Shares are of areas of the partial
/// model, whose unseen part bounds the object.
struct NextRest {
  StableRest rest;                                           ///< the pose's frame: its normal would point down
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< the shortest one from the present rest onto this one
  double gain = 0.0;          ///< share of the unseen surface that it is expected to show
  double unseen_after = 0.0;  ///< share of all surface that neither pose would have shown
  double overlap = 0.0;       ///< share of what the two poses see that both do, counted in either
  /// The least eigenvalue of the point-to-plane normal matrix over the surface seen in both, over their mean; turns are
  /// about its middle, in units of its mean reach. 0: it can move along itself.
  double stiffness = 0.0;
  Eigen::Vector3d weak_axis = Eigen::Vector3d::Zero();  ///< of the least stiff turn or shift
  PoseOutlook outlook = PoseOutlook::findable;
};

struct NextRests {
  double unseen = 0.0;          ///< share of all surface after the present pose
  std::vector<NextRest> rests;  ///< best first: of those whose pose could be found the largest gain, then the others
};

/// How an object could lie in the next pose. `partial`: the closed model of the present pose, mm, in its turntable
/// frame, with `views`; `angles_rad`: of the table, in the next pose. It is put with its centre of mass over the axis.
/// Rests are those of the convex hull [Park and Subbarao 2002, 3.2], sight is traced against the partial model. The
/// search for the next best view by what is still unknown follows Connolly, ICRA 1985.
/// Threads: spread over the current arena, same bits for any number. Fails with `not_closed`, `degenerate`,
/// `invalid_input` (no `views`, no angles).
Result<NextRests> next_rests(const Mesh& partial, std::span<const double> angles_rad, const RigEyes& eyes,
                             const NextRestOptions& options = {});

/// Which of `suggested` the object was laid on: the rest whose normal is within `same_deg` of `down`, a unit vector in
/// the same frame; -1: none of them.
int index_of_rest(std::span<const NextRest> suggested, const Eigen::Vector3d& down, double same_deg = 15.0);

}  // namespace scanrig
