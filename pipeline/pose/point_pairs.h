#pragma once

#include <span>
#include <vector>

#include "core/transform.h"
#include "pipeline/registration/range_surface.h"

namespace scanrig {

/// A motion that many pairs of oriented points agree on.
struct Vote {
  Transform pose1_from_pose2;
  double votes = 0.0;
};

/// Global search without any knowledge of rests: oriented point pairs (distance and three angles) of surface 1 in a
/// table; pairs of surface 2 look theirs up and vote for the motion that carries one onto the other [Drost, Ulrich,
/// Navab, Ilic 2010]. The motions with most votes, best first, at most `most`, distinct by 12 deg or 6 % of `size_mm`.
std::vector<Vote> vote_by_point_pairs(std::span<const SurfacePoint> surface1, std::span<const SurfacePoint> surface2,
                                      double size_mm, int most);

}  // namespace scanrig
