#pragma once

#include <array>

#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/vertex_neighbours.h"

namespace scanrig {

/// Roughness: what the surface around has beyond a quadratic, root mean square over a matching window, in units of
/// sigma. It tells noise from shape. Values at six of it, linear in between, constant outside.
using ByRoughness = std::array<float, 6>;

struct DenoiseOptions {
  ByRoughness roughness = {0.5F, 0.9F, 1.3F, 2.0F, 3.0F, 5.0F};
  /// Shares taken out of three bands: finer than half a window's half width; from there to sqrt(2) times that; from
  /// there to the half width. Noise is more than these bands hold, hence shares above 1; matching flattens shape of a
  /// window's size, hence shares below 0. What is much larger than noise stays. See README.md for where they are from.
  std::array<ByRoughness, 3> shares = {{{0.8F, 0.8F, 0.7F, 0.5F, 0.3F, 0.0F},
                                        {1.0F, 2.4F, 1.0F, -0.4F, -0.4F, 0.0F},
                                        {1.2F, -0.8F, -0.8F, -0.3F, -0.2F, 0.0F}}};
  /// What is left of sigma; proportional to roughness beyond the last.
  ByRoughness sigma = {0.65F, 0.88F, 1.07F, 1.27F, 1.5F, 2.4F};
  float min_measured = 0.95F;  ///< share of measured surface around, or a vertex stays and its sigma does not fall
};

/// Takes noise out of the measured surface and says what sigma is left. Noise of neighbouring vertices is alike over
/// less than a matching window. With G a Gaussian, (1 - G)^2 leaves nothing of a quadratic [twicing, Tukey 1977]: of a
/// smooth surface it is the noise. Vertices move along their normals; unmeasured ones stay. `window_mm`: half width of
/// the matching window on the surface; 0 (imported range images): nothing is done. Same bits for any number of threads.
void denoise(const VertexNeighbours& around, const DenoiseOptions& options, float window_mm, Mesh& mesh);

}  // namespace scanrig
