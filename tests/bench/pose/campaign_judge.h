#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/stable_rests.h"
#include "pipeline/registration/refine_pose.h"
#include "tests/bench/pose/campaign_rig.h"

/// What a trial's result is worth: it is compared with where the object really stood.
namespace scanrig::campaign {

/// The object as it is, and where it stood.
struct Truth {
  const Mesh& mesh;
  SurfaceIndex surface;
  SolidProperties properties;
  std::vector<StableRest> rests;
  std::vector<SurfaceSample> samples;
  Transform pose1_from_object, pose2_from_object;

  [[nodiscard]] Transform pose1_from_pose2() const { return pose1_from_object * pose2_from_object.inverse(); }
};

/// The object with its rests, and no place yet.
Result<Truth> truth_of(const Mesh& mesh);

std::vector<SurfaceSample> samples_of(const Mesh& mesh, std::size_t count);

/// How far a motion puts pose 2's surface from the true one: quantiles and the largest distance, mm.
struct SurfaceError {
  double median_mm = 0.0, p95_mm = 0.0, max_mm = 0.0;
};
SurfaceError surface_error(const Truth& truth, const Transform& pose1_from_pose2);

/// Where the registered views put a pose's surface, from where it is: a table that is higher than its calibration says
/// carries both poses alike, and is no error of the motion between them.
Transform as_measured(const std::vector<View>& views, const std::vector<Mark>& marks);

/// Errors of a refined motion. `measured_from_true1`, `...2`: as_measured() of the poses. A symmetric object's have no
/// errors by direction: any of its turns is as good.
nlohmann::json judged(const Truth& truth, const Transform& measured_from_true1, const Transform& measured_from_true2,
                      const RefinedPose& refined, bool is_symmetric);

/// A motion of the search.
nlohmann::json judged(const Truth& truth, const Candidate& candidate);

}  // namespace scanrig::campaign
