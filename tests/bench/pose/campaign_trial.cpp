#include "tests/bench/pose/campaign_trial.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>
#include <utility>

#include "core/units.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/refine_found.h"
#include "pipeline/pose/rig_sight.h"
#include "pipeline/reconstruct/rig_watch.h"
#include "pipeline/registration/moved_views.h"
#include "pipeline/registration/refine_pose.h"
#include "pipeline/volume/integrate.h"
#include "pipeline/volume/silhouette_votes.h"
#include "tests/bench/pose/campaign_judge.h"

namespace scanrig::campaign {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

constexpr double kPartialVoxelMm = 0.8;  // as a reconstruction takes for partial models
constexpr int kRegistrationRounds = 3;   // the same
constexpr double kUpsideDownDeg = 20.0;
constexpr double kOtherRestDeg = 15.0;  // rests nearer than this are one
constexpr double kSameRestDeg = 0.01;
constexpr double kJitterMm = 4.0;  // of the place on the table
constexpr std::size_t kOverlapSamples = 600;
constexpr int kDraws = 24;      // of rests, until their overlap is enough
constexpr double kHitMm = 1.0;  // farthest that a found pose may put the surface elsewhere

/// Processor time of this thread, on which a whole trial runs: what runs beside it does not count.
class Clock {
 public:
  double seconds() {
    const double now = read();
    return now - std::exchange(begun_, now);
  }

 private:
  static double read() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double begun_ = read();
};

Transform placed_on(const StableRest& rest, const Truth& truth, Chance& chance) {
  Transform pose = Transform::Identity();
  pose.linear() = rot_y(to_radians(chance.between(0.0, 360.0))).linear() *
                  Eigen::Quaterniond::FromTwoVectors(rest.normal, -Vector3d::UnitY()).toRotationMatrix();
  const Vector3d centre = pose.linear() * truth.properties.centre_of_mass;
  pose.translation() = Vector3d(chance.between(-kJitterMm, kJitterMm) - centre.x(), rest.offset_mm,
                                chance.between(-kJitterMm, kJitterMm) - centre.z());
  return pose;
}

double apart(const StableRest& a, const StableRest& b) {
  return to_degrees(std::acos(std::clamp(a.normal.dot(b.normal), -1.0, 1.0)));
}

/// Surface that both poses show, as a share of what the lesser one shows.
double overlap_of(const Truth& truth, const Calibration& rig) {
  std::vector<double> angles;
  for (int view = 0; view < 8; ++view) angles.push_back(to_radians(45.0 * view));
  const auto samples = samples_of(truth.mesh, kOverlapSamples);
  const RigEyes eyes = rig_eyes(rig);
  const auto seen1 = views_that_see(samples, truth.surface, truth.pose1_from_object, angles, eyes);
  const auto seen2 = views_that_see(samples, truth.surface, truth.pose2_from_object, angles, eyes);
  double one = 0, two = 0, both = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    one += seen1[i] != 0;
    two += seen2[i] != 0;
    both += seen1[i] != 0 && seen2[i] != 0;
  }
  return both / std::max(std::min(one, two), 1.0);
}

/// Whether rests so far apart are what the trial asks for.
bool is_flip(Flip flip, double angle_deg) {
  switch (flip) {
    case Flip::none: return angle_deg < kSameRestDeg;
    case Flip::any: return angle_deg > kOtherRestDeg;
    case Flip::beside: return angle_deg > kOtherRestDeg && angle_deg <= 180.0 - kUpsideDownDeg;
    case Flip::upside_down: return angle_deg > 180.0 - kUpsideDownDeg;
  }
  return false;
}

/// Draws two rests and places the object on them; the overlap, or nothing where there are no such rests.
std::optional<double> place(Truth& truth, const Rig& rig, const TrialOptions& options, Chance& chance) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < truth.rests.size(); ++i) {
    for (std::size_t k = 0; k < truth.rests.size(); ++k) {
      if (is_flip(options.flip, apart(truth.rests[i], truth.rests[k]))) pairs.emplace_back(i, k);
    }
  }
  for (int draw = 0; draw < kDraws && !pairs.empty(); ++draw) {
    const auto [first, second] = pairs[static_cast<std::size_t>(chance.among(static_cast<int>(pairs.size())))];
    truth.pose1_from_object = placed_on(truth.rests[first], truth, chance);
    truth.pose2_from_object = placed_on(truth.rests[second], truth, chance);
    const double overlap = overlap_of(truth, rig.truth);
    if (overlap >= options.min_overlap) return overlap;
  }
  return std::nullopt;
}

/// The views of one pose, registered, and its partial model: as Reconstruction::finish_pose.
struct ScannedPose {
  std::vector<View> views;
  std::vector<Mark> marks;
  RegistrationReport registration;
  Surface partial;
  double registration_s = 0.0, partial_s = 0.0;
};

Result<RegistrationReport> align_views(std::vector<View>& views, const RegistrationOptions& priors) {
  const auto undo = [&] {
    const auto motions = find_object_motions(views, priors);
    for (const ObjectMotion& motion : motions) undo_motion(views, motion);
    return !motions.empty();
  };
  undo();
  for (int round = 0;; ++round) {
    auto report = register_views(views, priors, {});
    if (!report || round + 1 == kRegistrationRounds) return report;
    const bool has_moved = undo();
    const auto misfits = views_that_do_not_fit(views, *report);
    for (auto v = misfits.rbegin(); v != misfits.rend(); ++v)
      views.erase(views.begin() + static_cast<std::ptrdiff_t>(*v));
    if (!has_moved && misfits.empty()) return report;
  }
}

Result<ScannedPose> finish(Scan scan, const Calibration& calibration) {
  ScannedPose pose{.views = std::move(scan.views), .marks = std::move(scan.marks), .registration = {}, .partial = {}};
  Clock clock;
  auto registered = align_views(pose.views, registration_options(calibration));
  if (!registered) return pass_on(registered, "registration");
  pose.registration = std::move(*registered);
  const auto verdict = vote_on_silhouettes(pose.views, {}, {});
  if (!verdict) return pass_on(verdict);
  pose.registration_s = clock.seconds();
  const PosedViews posed{.views = pose.views};
  auto partial = integrate(
      {&posed, 1},
      {.voxel_mm = kPartialVoxelMm, .denoise = std::nullopt, .table_without_silhouettes = true, .untangle = false});
  if (!partial) return pass_on(partial, "partial model");
  pose.partial = std::move(*partial);
  pose.partial_s = clock.seconds();
  return pose;
}

/// Whether one generator alone leads to the pose.
bool finds(const Truth& truth, const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options) {
  const auto estimate = estimate_pose(pose1, pose2, options, {});
  return estimate && surface_error(truth, estimate->pose1_from_pose2).max_mm < kHitMm;
}

json each_generator(const Truth& truth, const PoseInput& pose1, const PoseInput& pose2) {
  PoseOptions hull, egi, point_pairs;
  hull.point_pairs = egi.point_pairs = false;
  egi.rests = PoseOptions::Rests::egi;
  point_pairs.stable_tangent_planes = false;
  return {{"hull", finds(truth, pose1, pose2, hull)},
          {"egi", finds(truth, pose1, pose2, egi)},
          {"point pairs", finds(truth, pose1, pose2, point_pairs)}};
}

/// Estimation and refinement, as Reconstruction does both.
void find_pose(const Truth& truth, const ScannedPose& one, const ScannedPose& two, const Rig& rig,
               bool tries_generators, json& result) {
  const PoseInput pose1{one.partial.mesh, one.views}, pose2{two.partial.mesh, two.views};
  Clock clock;
  const auto estimate = estimate_pose(pose1, pose2, {}, {});
  result["estimate_s"] = clock.seconds();
  if (tries_generators) result["generators"] = each_generator(truth, pose1, pose2);
  if (!estimate) {
    result["verdict"] = to_string(estimate.error().code);
    result["message"] = estimate.error().message;
    return;
  }
  result["generator"] = estimate->best.generator;
  result["best"] = judged(truth, estimate->best);
  for (const Candidate& c : estimate->alternatives) result["alternatives"].push_back(judged(truth, c));
  const bool is_symmetric = estimate->symmetry.group != Symmetry::Group::none;
  if (is_symmetric) {
    result["symmetry"] = {{"group", to_string(estimate->symmetry.group)},
                          {"of", to_string(estimate->symmetry.of)},
                          {"fold", estimate->symmetry.fold}};
  }
  RefineOptions refinement = after_search();
  refinement.contacts = estimate->best.contacts;
  refinement.held = estimate->symmetry.free_turns();
  const RegistrationOptions known = registration_options(rig.calibration);
  refinement.axis = {to_radians(known.axis_tilt_sigma_deg), known.axis_shift_sigma_mm};
  refinement.calibration = calibration_modes(rig.calibration, rig.calibration.left.camera_from_turntable);
  clock.seconds();
  const MeasuredPose measured1 = measured_pose(one.views), measured2 = measured_pose(two.views);
  const auto refined =
      refine_found({&measured1, one.views}, {&measured2, two.views}, estimate->pose1_from_pose2, refinement, {}, {});
  result["refine_s"] = clock.seconds();
  if (!refined) {
    result["verdict"] = to_string(refined.error().code);
    result["message"] = refined.error().message;
    return;
  }
  result["verdict"] = "model";
  result.update(
      judged(truth, as_measured(one.views, one.marks), as_measured(two.views, two.marks), *refined, is_symmetric));
}

json registration_json(const ScannedPose& pose) {
  double worst = 0.0;
  for (const ViewFit& fit : pose.registration.views) worst = std::max(worst, fit.median_after_mm);
  return {{"views", pose.views.size()},
          {"median_mm", pose.registration.median_after_mm},
          {"worst_mm", worst},
          {"angles", pose.registration.angle_observable},
          {"axis_tilt_deg", pose.registration.axis_tilt_deg},
          {"axis_shift_mm", pose.registration.axis_shift_mm}};
}

/// Another object on a rest of its own.
Result<Scan> scan_another(const DrawnObject& object, const Rig& rig, Chance& chance) {
  const auto truth = truth_of(object.mesh);
  if (!truth) return pass_on(truth);
  if (truth->rests.empty()) return fail(ErrorCode::degenerate, "another object without rests");
  const auto& rest = truth->rests[static_cast<std::size_t>(chance.among(static_cast<int>(truth->rests.size())))];
  return scan({object.mesh, truth->surface, placed_on(rest, *truth, chance)}, rig, {}, chance);
}

}  // namespace

Result<json> run_trial(const DrawnObject& object, const TrialOptions& options, Chance& chance) {
  Clock clock;
  auto truth = truth_of(object.mesh);
  if (!truth) return pass_on(truth);
  const Rig rig = draw_rig(chance);
  const auto overlap = place(*truth, rig, options, chance);
  if (!overlap) return fail(ErrorCode::degenerate, "an object without such rests");

  Scan scan1 = scan({object.mesh, truth->surface, truth->pose1_from_object}, rig, {}, chance);
  auto scan2 = options.another
                   ? scan_another(*options.another, rig, chance)
                   : Result<Scan>(scan({object.mesh, truth->surface, truth->pose2_from_object}, rig, {}, chance));
  if (!scan2) return pass_on(scan2);
  json result = {{"object", object.name},
                 {"upside_down", options.flip == Flip::upside_down},
                 {"turned_deg", to_degrees(rotation_angle(truth->pose1_from_pose2().linear()))},
                 {"overlap", *overlap},
                 {"scan_s", clock.seconds()}};
  if (options.another) result["another"] = options.another->name;
  const auto one = finish(std::move(scan1), rig.calibration), two = finish(std::move(*scan2), rig.calibration);
  if (!one || !two) {
    const Error& error = one ? two.error() : one.error();
    result["verdict"] = to_string(error.code);
    result["message"] = error.message;
    return result;
  }
  result["registered"] = {registration_json(*one), registration_json(*two)};
  result["registration_s"] = one->registration_s + two->registration_s;
  result["partial_s"] = one->partial_s + two->partial_s;
  find_pose(*truth, *one, *two, rig, options.tries_generators, result);
  return result;
}

}  // namespace scanrig::campaign
