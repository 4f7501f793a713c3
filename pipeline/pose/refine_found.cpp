#include "pipeline/pose/refine_found.h"

#include <utility>

#include "pipeline/pose/flat_contacts.h"
#include "pipeline/pose/pose_search.h"

namespace scanrig {

Result<RefinedPose> refine_found(const PoseObservations& pose1, const PoseObservations& pose2, const Transform& found,
                                 RefineOptions refinement, const PoseOptions& options, const Context& context) {
  if (options.stable_tangent_planes) {  // not on a fixture
    auto flat = flat_contacts(*pose1.measured, *pose2.measured, found);
    if (!flat.empty()) refinement.contacts = std::move(flat);
  }
  auto refined = refine_pose(*pose1.measured, *pose2.measured, found, refinement, context);
  if (!refined) return refined;
  const SearchRound& judged = options.last_round;
  const auto check = [&](const Transform& motion) {
    return check_samples(pose1, pose2, motion, judged.level, judged.reach * pose1.measured->size_mm, options.agreement);
  };
  const double spread = 1.4826 * refined->median_mm;
  if (!compare(check(found), check(refined->pose1_from_pose2), spread, options.agreement).separable) return refined;
  refinement.held.push_back(weakest_turn_of(*refined));
  auto held = refine_pose(*pose1.measured, *pose2.measured, found, refinement, context);
  if (held) held->covariance = refined->covariance;
  return held;
}

}  // namespace scanrig
