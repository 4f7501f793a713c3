#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/range_image.h"

/// Where single views of one object lie, when nothing is known about that.
namespace scanrig {

/// Maximum number of views that are placed: every two of them are compared.
inline constexpr std::size_t kMaxUnknownViews = 100;

struct PlaceViewsOptions {
  double min_link = 0.06;  ///< confirmed share of both surfaces from which two views hold each other in the refinement
};

/// Two views that see the same surface, after the refinement.
struct ViewLink {
  std::size_t view1 = 0, view2 = 1;
  double overlap = 0.0;    ///< share of both views' surfaces that the other sees too
  double median_mm = 0.0;  ///< of the distance between the surfaces
};

struct PlacedViews {
  std::vector<std::optional<Transform>> model_from_view;  ///< of every view; nothing: left out. The first: identity
  std::vector<ViewLink> links;
  double median_mm = 0.0;   ///< of the distance between surfaces that two views see, over all links
  std::size_t motions = 0;  ///< of pairs that fit, taken alone
};

/// Places views in the frame of the first that is kept [Huber, Automatic 3D modeling using range images obtained from
/// unknown viewpoints, 2001; Huber and Hebert 2003]: motions of all pairs from point pairs, each checked by surface and
/// free space; the spanning tree of maximum agreement, in which no two views may contradict each other; then all views
/// onto each other at once. The largest set of views that agree is kept, the others are left out.
/// `views`: each in a frame of its own, mm; `camera_from_pose` leads from that frame. No silhouettes are needed. Sizes,
/// noise and spacing may be any: lengths are measured in views. Same bits for any number of threads.
/// Where no two views fit together all are left out. Fails with `invalid_input` (fewer than two views, or more than
/// kMaxUnknownViews; one without surface), `stopped`.
Result<PlacedViews> place_views(std::span<const View> views, const PlaceViewsOptions& options, const Context& context);

}  // namespace scanrig
