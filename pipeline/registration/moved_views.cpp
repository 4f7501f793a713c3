#include "pipeline/registration/moved_views.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/registration/refine_pose.h"

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Motion that lays a view onto the one before it.
struct Step {
  Transform motion = Transform::Identity();
  double mm = 0.0;  ///< rms over the view's surface
};

MeasuredPose surface_of(const View& view, const MovedViewOptions& options) {
  MeasuredPose surface;
  surface.images.push_back({view.range});
  surface.size_mm = measured_size(surface.images[0]);
  surface.samples.emplace_back();
  if (surface.size_mm > 0.0) {
    surface.samples[0] = sample_surface(surface.images[0], surface.size_mm / options.samples_across);
  }
  return surface;
}

double rms_motion(const Transform& motion, const std::vector<SurfacePoint>& points) {
  double sum = 0.0;
  for (const SurfacePoint& p : points) sum += (motion * p.point - p.point).squaredNorm();
  return points.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(points.size()));
}

/// What two views say of the step between them. Directions in which they say little stay where they are.
Step step_between(const MeasuredPose& before, const MeasuredPose& after, const MovedViewOptions& options) {
  RefineOptions plain;
  plain.keep = 1.0;
  plain.robust_scales = 6.0;
  const RefinedPose found = align(before, after, Transform::Identity(), 0, options.capture_mm, plain);
  if (found.iterations == 0 || found.overlap < options.min_overlap) return {};
  const Eigen::Translation3d to_centre(found.centre);
  const Transform about_centre = to_centre.inverse() * found.pose1_from_pose2 * to_centre;
  const Eigen::AngleAxisd turn(about_centre.linear());
  Vector6 step;
  step << turn.angle() * turn.axis(), about_centre.translation();
  const double precision = found.information.bottomRightCorner<3, 3>().trace();
  const Matrix6 data = found.information / (1.0 + precision * options.bias_mm * options.bias_mm);
  Vector6 prior;
  prior << Eigen::Vector3d::Constant(to_radians(options.step_sigma_deg)),
      Eigen::Vector3d::Constant(options.step_sigma_mm);
  Matrix6 both = data;
  both.diagonal() += prior.cwiseAbs2().cwiseInverse();
  step = both.ldlt().solve(data * step);
  Step result;
  result.motion = to_centre * small_motion(step.head<3>(), step.tail<3>()) * to_centre.inverse();
  result.mm = rms_motion(result.motion, after.samples[0]);
  return result;
}

double median_sigma(const RangeImage& range) {
  std::vector<double> sigmas;
  for (const float sigma : range.sigma) {
    if (!std::isnan(sigma)) sigmas.push_back(static_cast<double>(sigma));
  }
  return quantile(std::move(sigmas), 0.5);
}

/// Views of one pose, as one surface.
MeasuredPose joined(const std::vector<MeasuredPose>& surfaces, const std::vector<std::size_t>& views) {
  MeasuredPose all;
  all.images.emplace_back();
  all.samples.emplace_back();
  for (const std::size_t v : views) {
    const MeasuredPose& one = surfaces[v];
    all.images[0].insert(all.images[0].end(), one.images[0].begin(), one.images[0].end());
    all.samples[0].insert(all.samples[0].end(), one.samples[0].begin(), one.samples[0].end());
    all.size_mm = std::max(all.size_mm, one.size_mm);
  }
  return all;
}

/// Drops motions that all the moved views share with those of no motion does not show alike: a step between two views
/// that share little can be noise along what they leave open.
void drop_unconfirmed(const std::vector<MeasuredPose>& surfaces, const MovedViewOptions& options,
                      std::vector<ObjectMotion>& motions) {
  const auto views_of = [&](const ObjectMotion& motion) {
    std::vector<std::size_t> views;
    for (std::size_t k = 0; k < motion.views; ++k) views.push_back((motion.view + k) % surfaces.size());
    return views;
  };
  std::vector<std::size_t> staying(surfaces.size());
  std::iota(staying.begin(), staying.end(), std::size_t{0});
  for (const ObjectMotion& motion : motions) {
    for (const std::size_t v : views_of(motion)) std::erase(staying, v);
  }
  const MeasuredPose rest = joined(surfaces, staying);
  std::erase_if(motions, [&](const ObjectMotion& motion) {
    const MeasuredPose moved = joined(surfaces, views_of(motion));
    const Step together = step_between(rest, moved, options);
    return rms_motion(together.motion.inverse() * motion.back, moved.samples[0]) > options.max_difference * motion.mm;
  });
}

/// Runs of views between the steps, as motions against the longest run.
std::vector<ObjectMotion> motions_of(const std::vector<Step>& steps, const std::vector<std::size_t>& large) {
  const std::size_t views = steps.size();
  const auto length = [&](std::size_t run) {
    return (large[(run + 1) % large.size()] + views - large[run] - 1) % views + 1;
  };
  std::size_t longest = 0;
  for (std::size_t run = 1; run < large.size(); ++run) {
    if (length(run) > length(longest)) longest = run;
  }
  std::vector<ObjectMotion> motions;
  Transform back = Transform::Identity();
  for (std::size_t k = 1; k < large.size(); ++k) {
    const std::size_t run = (longest + k) % large.size();
    back = back * steps[large[run]].motion;
    motions.push_back({large[run], length(run), 0.0, back});
  }
  std::ranges::sort(motions, {}, &ObjectMotion::view);
  return motions;
}

}  // namespace

std::vector<ObjectMotion> find_object_motions(std::span<const View> views, const RegistrationOptions& priors,
                                              const MovedViewOptions& options) {
  if (views.size() < options.min_views) return {};
  std::vector<MeasuredPose> surfaces(views.size());
  parallel_for(views.size(), [&](std::size_t v) { surfaces[v] = surface_of(views[v], options); });
  std::vector<Step> steps(views.size());
  std::vector<double> sizes;
  for (std::size_t v = 0; v < views.size(); ++v) {
    steps[v] = step_between(surfaces[(v + views.size() - 1) % views.size()], surfaces[v], options);
    sizes.push_back(steps[v].mm);
  }
  const double least = options.min_sigmas * std::sqrt(2.0) * priors.translation_sigma_mm;
  const double limit = std::max(least, options.min_rarity * quantile(sizes, 0.5));
  std::vector<std::size_t> large;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (steps[v].mm > limit) large.push_back(v);
  }
  // A single step does not close the ring: what it closes with is too small to be told from vibration.
  if (large.size() < 2) return {};
  std::vector<ObjectMotion> motions = motions_of(steps, large);
  for (ObjectMotion& motion : motions) motion.mm = rms_motion(motion.back, surfaces[motion.view].samples[0]);
  drop_unconfirmed(surfaces, options, motions);
  return motions;
}

void undo_motion(std::span<View> views, const ObjectMotion& motion) {
  const Transform move = motion.back.inverse();
  for (std::size_t k = 0; k < motion.views; ++k) {
    View& view = views[(motion.view + k) % views.size()];
    view.range.camera_from_pose = view.range.camera_from_pose * move;
    for (Silhouette& s : view.silhouettes) s.camera_from_pose = s.camera_from_pose * move;
  }
}

std::vector<std::size_t> views_that_do_not_fit(std::span<const View> views, const RegistrationReport& report,
                                               const MovedViewOptions& options) {
  std::vector<std::size_t> result;
  if (views.size() < options.min_views) return result;
  std::vector<double> residuals;
  for (const ViewFit& fit : report.views) {
    if (std::isfinite(fit.median_after_mm)) residuals.push_back(fit.median_after_mm);
  }
  const double usual = quantile(std::move(residuals), 0.5);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double own = report.views[v].median_after_mm;
    if (own > options.min_residual * usual && own > options.min_residual * median_sigma(views[v].range)) {
      result.push_back(v);
    }
  }
  return result;
}

}  // namespace scanrig
