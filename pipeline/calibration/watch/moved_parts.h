#pragma once

#include <array>

#include "pipeline/calibration/watch/rig_fit.h"
#include "pipeline/calibration/watch/rig_priors.h"

namespace scanrig {

/// One part's own motion and what its measurement can be off by.
struct PartMotion {
  PoseChange change = PoseChange::Zero();      ///< of both cameras' poses, by this part alone
  PoseMatrix covariance = PoseMatrix::Zero();  ///< of `change`: noise, and the calibration's covariance
};

/// What a rig's departure from its calibration is made of.
struct MovedParts {
  std::array<PartMotion, 2> camera;
  PartMotion table;                                ///< and its axis, against both cameras
  PartMotion pair;                                 ///< both cameras' together
  TableChange table_change = TableChange::Zero();  ///< as RigPriors::table_variance
};

/// Shares out what dots and rows show over left camera, right camera and table. The likeliest of all sets of parts that
/// moved (a moved part drifts as `priors` says, others a thirtieth of it) decides who takes how much: dots that shift
/// alike in both images are the table's, those of one image its camera's. The calibration's own error is no
/// explanation: it was fitted to the same dots; it is in the covariances.
MovedParts find_moved_parts(const RigFit& fit, const RigPriors& priors);

}  // namespace scanrig
