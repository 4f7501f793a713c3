#pragma once

#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

struct SilhouetteVoteOptions {
  double contour_px = 3.0;        ///< a sure contour is off by less: half of the band in which pixels are mixed
  int min_views = 2;              ///< that measured a point, for it to vote against a silhouette
  float sigmas = 3.0F;            ///< within this many standard deviations two views agree on a point
  int stride_px = 2;              ///< one pixel in this many, each way, of the range images votes
  double max_beyond_px = 1.0;     ///< of measured surface beyond the outline; where it is more, the outline moves
  int min_region_px = 40;         ///< smaller contradictions are not named
  double max_contradicted = 0.5;  ///< of the object's area in the image: beyond it the silhouette is left out whole
  int min_disputing = 3;          ///< views whose silhouettes put a measured point outside, for it to be disputed
  int min_silhouettes = 2;        ///< others that see a ray's whole length empty, for it to be named as surplus
  int surplus_stride_px = 8;      ///< grid of those rays
  double min_surplus = 0.01;      ///< of the silhouette's area: less is not named
  bool finds_surplus = true;      ///< else surplus is not looked for
};

/// What is wrong with one silhouette, found by disagreement with the other images of its pose.
struct SilhouetteFinding {
  enum class Kind {
    region,  ///< part of it cuts through measured surface: that part carves no more
    whole,   ///< most of it does: it carves no more
    surplus  ///< it holds for object what others see empty: harmless, the hull is the intersection
  };
  Kind kind = Kind::region;
  int view = 0;            ///< View::index
  std::size_t camera = 0;  ///< 0 left, 1 right
  double area_px = 0.0;    ///< of that part
  double share = 0.0;      ///< of the object's area in the image
  int views = 0;           ///< that measured the surface there, median; of `surplus` silhouettes that see it empty
};

struct SilhouetteVerdict {
  std::vector<SilhouetteFinding> findings;  ///< in the order of views
  /// Of the points that `min_views` measured, those that `min_disputing` views put outside: more than a few per
  /// cent are no single image. The object has the screen's colour, or the calibration is off.
  double disputed_share = 0.0;
};

/// Judges every silhouette of one pose by the surface that its registered views measured, and mends it: a point that
/// more views measured than have silhouettes that put it outside votes against each of these. Where votes cover a
/// connected part of a silhouette, that part becomes object, and background in the view's range image becomes unknown
/// there; so does the rim where surface reaches a little beyond the outline, which is no finding. Opening and screen
/// that nothing contradicts stay, so what views look through stays open. Same bits for any number of threads. Fails
/// with `stopped`; some silhouettes may then be mended.
Result<SilhouetteVerdict> vote_on_silhouettes(std::span<View> views, const SilhouetteVoteOptions& options,
                                              const Context& context);

}  // namespace scanrig
