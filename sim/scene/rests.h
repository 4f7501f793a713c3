#pragma once

#include <cstdint>

#include "core/result.h"
#include "core/transform.h"
#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// A stable orientation of the object on a plane.
struct Rest {
  Eigen::Vector3d down = -Eigen::Vector3d::UnitY();  ///< unit, in the object's frame: direction to the table
  double height = 0.0;                               ///< mm from the plane to the centre of mass
  double chance = 0.0;                               ///< share of random drops that end here
};

/// Puts the object down in random orientations and rolls it, corner by corner and edge by edge, until its centre of
/// mass can sink no lower. Rests from which a tilt of 2 degrees in some direction would make it roll on are left out.
/// Most likely first. Same seed, same rests.
std::vector<Rest> stable_rests(const TriangleMesh& mesh, std::uint64_t seed);

/// Rests more than 30 degrees apart, one for each of `count` placements and two at least, drawn by chance, and the
/// placements for them: lowest point on y = 0, bounding cylinder within 3 mm of the axis, turned at random. Where there
/// are not so many rests they come again, in their order; with `same_rest` all use the first. Each is turned and moved
/// anew. Fails with `degenerate` (fewer than two such rests), `invalid_input` (larger than the working volume, unless
/// `any_size`).
Result<std::vector<Transform>> draw_placements(const TriangleMesh& mesh, std::uint64_t seed, int count, bool same_rest,
                                               bool any_size = false);

/// `count` placements of an object with a holder, upright, otherwise as draw_placements(). Fails with `invalid_input`.
Result<std::vector<Transform>> upright_placements(const TriangleMesh& mesh, std::uint64_t seed, int count,
                                                  bool any_size = false);

}  // namespace scanrig::sim
