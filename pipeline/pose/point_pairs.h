#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/transform.h"
#include "pipeline/registration/range_surface.h"

namespace scanrig {

/// A motion with the votes of many pairs of oriented points.
struct Vote {
  Transform pose1_from_pose2;
  double votes = 0.0;
};

/// Tables and votes of the search.
struct PointPairOptions {
  int distance_steps = 16;        ///< over the range of distances used
  int angle_steps = 15;           ///< over 180 deg
  int turn_steps = 30;            ///< over 360 deg
  double min_length = 0.12;       ///< of a pair, as a share of the object's size
  double max_length = 0.6;        ///< of a pair, as a share of the object's size
  std::size_t references = 200;   ///< points of surface 2 that vote
  std::uint32_t max_alike = 400;  ///< pairs compared per key
  std::size_t peaks = 3;          ///< motions taken from each reference point
  double same_deg = 12.0;         ///< motions closer than this and ...
  double same_shift = 0.06;       ///< ... this share of the object's size are one
};

/// All pairs of oriented points (distance and three angles) of one surface in a table, to be compared with any number
/// of other surfaces [Drost, Ulrich, Navab, Ilic 2010]. Threads: vote() may be called from several.
class PointPairTable {
 public:
  /// `size_mm` of the object gives distances their scale: tables and surfaces that are compared have one.
  PointPairTable(std::span<const SurfacePoint> surface1, double size_mm, const PointPairOptions& options = {});

  /// Pairs of surface 2 look theirs up and vote for the motion that carries one onto the other. Returns the motions
  /// with most votes, best first, at most `max_motions`, distinct by `same_deg` or `same_shift`.
  [[nodiscard]] std::vector<Vote> vote(std::span<const SurfacePoint> surface2, int max_motions) const;

 private:
  struct Entry {
    std::uint32_t reference;
    float turn;
  };
  [[nodiscard]] std::vector<Vote> votes_of(std::span<const SurfacePoint> surface2, std::size_t reference) const;

  PointPairOptions options_;
  double size_mm_;
  std::vector<std::uint32_t> begin_;  ///< per key; one more at the end
  std::vector<Entry> entries_;
  std::vector<Transform> local_;  ///< from the surface's frame: each point at the origin, its normal along x
};

/// The same for two surfaces that are compared once: a global search without rests.
std::vector<Vote> vote_by_point_pairs(std::span<const SurfacePoint> surface1, std::span<const SurfacePoint> surface2,
                                      double size_mm, int max_motions, const PointPairOptions& options = {});

}  // namespace scanrig
