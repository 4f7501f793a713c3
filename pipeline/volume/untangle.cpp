#include "pipeline/volume/untangle.h"

#include <limits>

#include "pipeline/mesh/self_intersection.h"

namespace scanrig {

Result<std::size_t> untangle(const std::vector<Eigen::Vector3f>& before, Mesh& mesh) {
  std::size_t count = 0;
  std::vector<bool> is_back(mesh.vertices.size(), false);
  for (;;) {
    const auto surface = SurfaceIndex::create(mesh);
    if (!surface) return pass_on(surface);
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t face : self_intersecting_faces(mesh, *surface)) {
      for (const std::uint32_t v : mesh.faces[face]) {
        if (!is_back[v]) corners.push_back(v);
      }
    }
    // Every round takes at least one vertex back; if all are back and faces still cross, they crossed before.
    if (corners.empty()) return count;
    for (const std::uint32_t v : corners) {
      if (is_back[v]) continue;
      is_back[v] = true;
      mesh.vertices[v] = before[v];
      mesh.views[v] = 0;
      mesh.sigma[v] = std::numeric_limits<float>::quiet_NaN();
      ++count;
    }
  }
}

}  // namespace scanrig
