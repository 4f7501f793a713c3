#include "pipeline/pose/convex_hull.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace scanrig {
namespace {

using Qhull = std::unique_ptr<qhT, void (*)(qhT*)>;

void free_qhull(qhT* qh) {
  int left = 0;
  int pieces = 0;
  qh_freeqhull(qh, !qh_ALL);
  qh_memfreeshort(qh, &left, &pieces);
  delete qh;
}

}  // namespace

double reach_along(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& direction) {
  const Eigen::Vector3f n = direction.cast<float>();
  float reach = -std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& p : points) reach = std::max(reach, n.dot(p));
  return reach;
}

Result<Mesh> convex_hull(std::span<const Eigen::Vector3f> points) {
  std::vector<coordT> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Eigen::Vector3f& p : points) coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});
  const std::unique_ptr<FILE, int (*)(FILE*)> silent(std::fopen("/dev/null", "w"), &std::fclose);
  const Qhull owner(new qhT, &free_qhull);
  qhT* qh = owner.get();
  qh_zero(qh, silent.get());
  char options[] = "qhull Qt Pp";  // triangles, no warnings
  const int failed = points.size() < 4 ? 1
                                       : qh_new_qhull(qh, 3, static_cast<int>(points.size()), coordinates.data(), False,
                                                      options, nullptr, silent.get());
  if (failed != 0) return fail(ErrorCode::degenerate, "convex hull: {} points span no volume", points.size());

  Mesh hull;
  std::vector<std::uint32_t> index_of(points.size(), std::numeric_limits<std::uint32_t>::max());
  const auto add = [&](const vertexT* vertex) {
    const int id = qh_pointid(qh, vertex->point);
    if (index_of[id] == std::numeric_limits<std::uint32_t>::max()) {
      index_of[id] = static_cast<std::uint32_t>(hull.vertices.size());
      hull.vertices.push_back(points[id]);
    }
    return index_of[id];
  };
  for (const facetT* facet = qh->facet_list; facet && facet->next; facet = facet->next) {
    Mesh::Face face{};
    for (int k = 0; k < 3; ++k) face[k] = add(static_cast<const vertexT*>(facet->vertices->e[k].p));
    const Eigen::Vector3f normal =
        (hull.vertices[face[1]] - hull.vertices[face[0]]).cross(hull.vertices[face[2]] - hull.vertices[face[0]]);
    const coordT* outward = facet->normal;
    if (normal.x() * outward[0] + normal.y() * outward[1] + normal.z() * outward[2] < 0) std::swap(face[1], face[2]);
    hull.faces.push_back(face);
  }
  return hull;
}

}  // namespace scanrig
