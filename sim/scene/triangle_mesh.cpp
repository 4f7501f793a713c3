#include "sim/scene/triangle_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/parallel.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Circle through(const Vector2d& a, const Vector2d& b) { return {0.5 * (a + b), 0.5 * (a - b).norm()}; }

Circle through(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d p = b - a, q = c - a;
  const double cross = 2.0 * (p.x() * q.y() - p.y() * q.x());
  if (std::abs(cross) < 1e-12) return {a, 0.0};
  const Vector2d centre((q.y() * p.squaredNorm() - p.y() * q.squaredNorm()) / cross,
                        (p.x() * q.squaredNorm() - q.x() * p.squaredNorm()) / cross);
  return {a + centre, centre.norm()};
}

/// Directions spread evenly over the sphere by the golden angle.
std::vector<Vector3d> spread_directions(int count) {
  std::vector<Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double y = 1.0 - (2.0 * i + 1.0) / count, r = std::sqrt(1.0 - y * y);
    const double phi = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    directions.emplace_back(r * std::cos(phi), y, r * std::sin(phi));
  }
  return directions;
}

/// Directions with their nearest common axis; none is farther from it than `chord`, both of length 1.
struct Cone {
  Vector3d axis;
  std::vector<Vector3d> directions;
  double chord = 0.0;
};

/// The same for every mesh.
const std::vector<Cone>& cones_all_around() {
  static const std::vector<Cone> all = [] {
    std::vector<Cone> cones;
    for (const auto& axis : spread_directions(1000)) cones.push_back({axis, {}, 0.0});
    for (const auto& d : spread_directions(20000)) {
      const auto farther = [&d](const Cone& a, const Cone& b) { return d.dot(a.axis) < d.dot(b.axis); };
      Cone& nearest = *std::ranges::max_element(cones, farther);
      nearest.directions.push_back(d);
      nearest.chord = std::max(nearest.chord, (nearest.axis - d).norm());
    }
    return cones;
  }();
  return all;
}

bool contains(const Circle& circle, const Vector2d& p) { return (p - circle.centre).norm() <= circle.radius + 1e-9; }

/// Welzl's algorithm, iterative form.
Circle circle_of_few(const std::vector<Vector2d>& points) {
  Circle circle{points[0], 0.0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (contains(circle, points[i])) continue;
    circle = {points[i], 0.0};
    for (std::size_t j = 0; j < i; ++j) {
      if (contains(circle, points[j])) continue;
      circle = through(points[i], points[j]);
      for (std::size_t k = 0; k < j; ++k) {
        if (!contains(circle, points[k])) circle = through(points[i], points[j], points[k]);
      }
    }
  }
  return circle;
}

}  // namespace

bool is_closed(const TriangleMesh& mesh) {
  std::vector<std::uint64_t> there, back;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const auto a = static_cast<std::uint64_t>(t[i]), b = static_cast<std::uint64_t>(t[(i + 1) % 3]);
      there.push_back(a << 32 | b);
      back.push_back(b << 32 | a);
    }
  }
  std::sort(there.begin(), there.end());
  std::sort(back.begin(), back.end());
  return !there.empty() && there == back && std::adjacent_find(there.begin(), there.end()) == there.end();
}

double volume(const TriangleMesh& mesh) {
  double six = 0.0;
  for (const auto& t : mesh.triangles) {
    six += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  }
  return six / 6.0;
}

Vector3d centre_of_mass(const TriangleMesh& mesh) {
  Vector3d sum = Vector3d::Zero();
  double total = 0.0;
  const bool solid = is_closed(mesh);
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    // A tetrahedron with the origin (its fourth corner), or the triangle itself.
    const double weight = solid ? a.dot(b.cross(c)) : (b - a).cross(c - a).norm();
    sum += weight * (a + b + c) / (solid ? 4.0 : 3.0);
    total += weight;
  }
  return sum / total;
}

std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vector3d> normals(mesh.vertices.size(), Vector3d::Zero());
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    const Vector3d n = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    for (const int corner : t) normals[corner] += n;
  }
  for (auto& n : normals) n = n.norm() > 0.0 ? Vector3d(n.normalized()) : Vector3d::UnitY();
  return normals;
}

std::vector<Vector3d> extreme_vertices(const std::vector<Vector3d>& vertices) {
  // A cone's axis first: the farthest vertex in a direction near it is nearly farthest along it, by at most the size of
  // the mesh times the angle between the two. Only such vertices are tested again.
  Vector3d middle = Vector3d::Zero();
  for (const auto& v : vertices) middle += v / static_cast<double>(vertices.size());
  double reach = 0.0;
  for (const auto& v : vertices) reach = std::max(reach, (v - middle).norm());
  const std::vector<Cone>& cones = cones_all_around();
  using Columns = Eigen::Matrix<float, Eigen::Dynamic, 3>;
  Columns all(vertices.size(), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) all.row(v) = (vertices[v] - middle).cast<float>();
  std::vector<std::vector<int>> best(cones.size());
  parallel_for(cones.size(), [&](std::size_t c) {
    const Eigen::VectorXf along = all * cones[c].axis.cast<float>();
    const float threshold = along.maxCoeff() - static_cast<float>(2.0 * reach * cones[c].chord);
    std::vector<int> near;
    for (int v = 0; v < along.size(); ++v) {
      if (along[v] >= threshold) near.push_back(v);
    }
    const Columns candidates = all(near, Eigen::all);
    for (const auto& d : cones[c].directions) {
      Eigen::Index farthest = 0;
      (candidates * d.cast<float>()).maxCoeff(&farthest);
      best[c].push_back(near[farthest]);
    }
  });
  std::vector<int> kept;
  for (const auto& b : best) kept.insert(kept.end(), b.begin(), b.end());
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  std::vector<Vector3d> extremes;
  for (const int v : kept) extremes.push_back(vertices[v]);
  return extremes;
}

double largest_extent(const std::vector<Vector3d>& vertices) {
  double squared = 0.0;
  for (const auto& a : vertices) {
    for (const auto& b : vertices) squared = std::max(squared, (a - b).squaredNorm());
  }
  return std::sqrt(squared);
}

Circle smallest_circle(const std::vector<Vector2d>& points) {
  // The circle of a few points, the farthest of all others added until none is outside: exact after a few rounds.
  if (points.empty()) return {};
  std::vector<Vector2d> chosen = {points[0]};
  for (;;) {
    const Circle circle = circle_of_few(chosen);
    const auto nearer = [&](const Vector2d& a, const Vector2d& b) {
      return (a - circle.centre).squaredNorm() < (b - circle.centre).squaredNorm();
    };
    const Vector2d& farthest = *std::max_element(points.begin(), points.end(), nearer);
    if (contains(circle, farthest)) return circle;
    chosen.push_back(farthest);
  }
}

}  // namespace scanrig::sim
