#include "pipeline/pose/solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace scanrig {
namespace {

std::uint64_t mix(std::uint64_t x) {  // SplitMix64
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

/// Each edge must be walked as often one way as the other: sums of a hash of the edge, signed by the way, cancel.
bool edges_cancel(const Mesh& mesh) {
  std::uint64_t sum = 0;
  for (const Mesh::Face& face : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = face[k];
      const std::uint64_t b = face[(k + 1) % 3];
      const std::uint64_t hash = mix((std::min(a, b) << 32) | std::max(a, b));
      sum += a < b ? hash : ~hash + 1;
    }
  }
  return sum == 0;
}

using Qhull = std::unique_ptr<qhT, void (*)(qhT*)>;

void free_qhull(qhT* qh) {
  int left = 0;
  int pieces = 0;
  qh_freeqhull(qh, !qh_ALL);
  qh_memfreeshort(qh, &left, &pieces);
  delete qh;
}

}  // namespace

Result<SolidFacts> solid_facts(const Mesh& solid) {
  if (solid.faces.size() < 4) return fail(ErrorCode::degenerate, "pose estimation: the partial model has no faces");
  if (!edges_cancel(solid)) {
    return fail(ErrorCode::not_closed, "pose estimation: the partial model is not closed: an edge has only one face");
  }
  SolidFacts facts;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& v : solid.vertices) box.extend(v.cast<double>());
  facts.size_mm = box.diagonal().norm();
  const Eigen::Vector3d apex = box.center();  // tetrahedra from here to each face
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const Mesh::Face& face : solid.faces) {
    const Eigen::Vector3d a = solid.vertices[face[0]].cast<double>() - apex;
    const Eigen::Vector3d b = solid.vertices[face[1]].cast<double>() - apex;
    const Eigen::Vector3d c = solid.vertices[face[2]].cast<double>() - apex;
    const double volume = a.dot(b.cross(c)) / 6.0;
    facts.volume_mm3 += volume;
    moment += volume * (a + b + c) / 4.0;
  }
  if (!(facts.volume_mm3 > 1e-6 * std::pow(facts.size_mm, 3))) {
    return fail(ErrorCode::degenerate, "pose estimation: the partial model encloses no volume ({:.3g} mm3)",
                facts.volume_mm3);
  }
  facts.centre_of_mass = apex + moment / facts.volume_mm3;
  return facts;
}

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
