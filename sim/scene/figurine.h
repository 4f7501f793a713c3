#pragma once

#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// The built-in object: a little figure with a hat, 100 mm high, its base at y = 0. Asymmetric about every axis, a
/// hollow underside, a thin hat brim and tail, ribs of 0.35 mm on the body. One closed surface of genus 0.
/// `cell`: lattice of the polygonisation, mm.
TriangleMesh figurine(double cell = 0.6);

}  // namespace scanrig::sim
