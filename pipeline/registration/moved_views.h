#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pipeline/range/range_image.h"
#include "pipeline/registration/register_views.h"

namespace scanrig {

struct MovedViewOptions {
  double min_sigmas = 2.0;       ///< of a step in what the priors allow two views: less is vibration
  double min_rarity = 2.5;       ///< times the median step between two views of this pose
  double min_residual = 3.0;     ///< times the median of the other views' residuals: such a view does not fit
  std::size_t min_views = 5;     ///< fewer have no majority
  double capture_mm = 1.0;       ///< farthest distance between the surfaces of two views
  double step_sigma_mm = 0.1;    ///< how far an object may have crept: holds what two views do not show
  double step_sigma_deg = 0.1;   ///< the same, how far it may have rocked
  double bias_mm = 0.01;         ///< error of two views' distance that more points do not average away
  double min_overlap = 0.1;      ///< of two neighbours; with less their step is unknown
  double max_difference = 0.33;  ///< share of a motion by which all moved views together may show another
  double samples_across = 70.0;  ///< points compared, across the object
};

/// Neighbouring views, from `view` on, in which the object stood elsewhere than in most views of its pose.
struct ObjectMotion {
  std::size_t view = 0;                    ///< the first of them, in the span
  std::size_t views = 1;                   ///< so many; they may go on at the span's start
  double mm = 0.0;                         ///< rms over the measured surface
  Transform back = Transform::Identity();  ///< from where it stood to where it stands in most views, pose frame
};

/// Where the object moved between the views of one pose, which `register_views` has been through: each view is aligned
/// with the one before it around the ring, by itself. What the priors cover is vibration; so is what all views share. A
/// step beyond both is the object's, if all that the moved views share with the others says so. Registration does not
/// undo it: its robust weights take such a view for outliers. In the order of the views. Same bits for any number of
/// threads.
std::vector<ObjectMotion> find_object_motions(std::span<const View> views, const RegistrationOptions& priors,
                                              const MovedViewOptions& options = {});

/// Lays those views, silhouettes included, back onto the others.
void undo_motion(std::span<View> views, const ObjectMotion& motion);

/// Views that still do not fit: their residual is far above the others' and above their own sigma.
std::vector<std::size_t> views_that_do_not_fit(std::span<const View> views, const RegistrationReport& report,
                                               const MovedViewOptions& options = {});

}  // namespace scanrig
