#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "core/transform.h"
#include "sim/scene/object.h"
#include "sim/scene/ray_caster.h"

namespace scanrig::sim {

/// What the operator holds an object with that is to lean.
enum class FixtureKind { none, putty, pins };

/// An object that leans, and what holds it.
struct HeldObject {
  Transform table_from_object = Transform::Identity();
  TriangleMesh fixture;  ///< in the object's frame, closed parts that may reach into the object
};

/// Tilts `placement` by 8 to 25 degrees, lifts the object's lowest point to 8 mm and puts putty (half an ellipsoid) or
/// three pins of 5 mm diameter under it. `rays`: of `mesh`. Same seed, same bits. Fails with `degenerate`: three pins
/// meet nothing of it.
Result<HeldObject> hold(const TriangleMesh& mesh, const RayCaster& rays, const Transform& placement, FixtureKind kind,
                        std::uint64_t seed);

/// Object and fixture as one to be looked at; the fixture looks like stone.
Object with_fixture(const Object& object, const TriangleMesh& fixture);

}  // namespace scanrig::sim
