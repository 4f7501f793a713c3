#include "pipeline/volume/untangle.h"

#include <limits>

#include "pipeline/mesh/self_intersection.h"

namespace scanrig {

std::size_t untangle(const std::vector<Eigen::Vector3f>& before, Mesh& mesh) {
  std::size_t count = 0;
  std::vector<bool> is_back(mesh.vertices.size(), false);
  std::vector<bool> is_moved;  // in the last round; all before the first
  for (;;) {
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t face : self_intersecting_faces(mesh, is_moved)) {
      for (const std::uint32_t v : mesh.faces[face]) {
        if (!is_back[v]) corners.push_back(v);
      }
    }
    // Every round takes at least one vertex back; if all are back and faces still cross, they crossed before.
    if (corners.empty()) return count;
    is_moved.assign(mesh.vertices.size(), false);
    for (const std::uint32_t v : corners) {
      if (is_back[v]) continue;
      is_back[v] = is_moved[v] = true;
      mesh.vertices[v] = before[v];
      mesh.views[v] = 0;
      mesh.sigma[v] = std::numeric_limits<float>::quiet_NaN();
      ++count;
    }
  }
}

}  // namespace scanrig
