#pragma once

#include "core/context.h"
#include "core/result.h"
#include "pipeline/pose/agreement.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/registration/refine_pose.h"

namespace scanrig {

/// refine_pose() of a motion that a search has found. Where the refined motion contradicts more than the found one,
/// beyond chance, the turn that the surfaces hold least stays as it was found: of a body of revolution all the rest may
/// turn its one small feature out of its place. How well the motion is known is told as without that. Flat contacts,
/// where there are any, take the place of `refinement.contacts`; not on a fixture, see
/// `PoseOptions::stable_tangent_planes`.
Result<RefinedPose> refine_found(const PoseObservations& pose1, const PoseObservations& pose2, const Transform& found,
                                 RefineOptions refinement, const PoseOptions& options, const Context& context);

}  // namespace scanrig
