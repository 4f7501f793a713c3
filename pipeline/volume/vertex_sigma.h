#pragma once

#include <vector>

#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/vertex_neighbours.h"
#include "pipeline/volume/distance_field.h"

namespace scanrig {

/// Where the views around scatter more than their sigmas let expect, sigma is larger by that [the Birge ratio].
/// `scatter`: of each vertex; `rounds` of a mean over the neighbours.
void widen_by_scatter(const VertexNeighbours& around, int rounds, const std::vector<Scatter>& scatter, Mesh& mesh);

/// What all views get wrong alike: shape that a quadratic over one matching window cannot follow. Taken from the
/// surface itself: the part beyond a quadratic at the window's size, `share` of which is added to sigma in quadrature.
/// `window_mm`: half width of the window on the surface; 0: sigma stays.
void widen_by_fine_shape(const VertexNeighbours& around, float share, float window_mm, Mesh& mesh);

}  // namespace scanrig
