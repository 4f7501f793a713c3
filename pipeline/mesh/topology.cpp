#include "pipeline/mesh/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>

namespace scanrig {
namespace {

/// A face's edge, its smaller vertex first, for sorting equal edges together.
struct Edge {
  std::uint32_t low, high, face;
  bool forward;  ///< the face walks from low to high
};

template <class Body>
void for_each_edge(const Mesh& mesh, const Body& body) {
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.faces[f][k], b = mesh.faces[f][(k + 1) % 3];
      body(Edge{std::min(a, b), std::max(a, b), f, a < b});
    }
  }
}

/// By smaller vertex, larger vertex, face. A vertex has few edges: they are counted into their places, then sorted.
std::vector<Edge> sorted_edges(const Mesh& mesh) {
  std::vector<std::size_t> next(mesh.vertices.size() + 1);
  for_each_edge(mesh, [&](const Edge& edge) { ++next[edge.low + 1]; });
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<Edge> edges(3 * mesh.faces.size());
  for_each_edge(mesh, [&](const Edge& edge) { edges[next[edge.low]++] = edge; });
  std::size_t first = 0;  // after the loop above `next` holds the ends
  for (const std::size_t end : next) {
    std::sort(edges.begin() + static_cast<std::ptrdiff_t>(first), edges.begin() + static_cast<std::ptrdiff_t>(end),
              [](const Edge& a, const Edge& b) { return a.high != b.high ? a.high < b.high : a.face < b.face; });
    first = end;
  }
  return edges;
}

/// Disjoint sets of small integers; the root is the smallest member.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

bool is_degenerate(const Mesh::Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; }

/// Vertices whose corners fall into more than one fan; a fan is a set of corners joined through shared edges.
std::size_t count_split_vertices(const Mesh& mesh, const std::vector<Edge>& edges) {
  const auto corner = [&](std::uint32_t face, std::uint32_t vertex) {
    const auto& f = mesh.faces[face];
    return 3 * face + (f[0] == vertex ? 0U : f[1] == vertex ? 1U : 2U);
  };
  DisjointSets fans(3 * mesh.faces.size());
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const Edge &a = edges[i - 1], &b = edges[i];
    if (a.low != b.low || a.high != b.high) continue;
    fans.join(corner(a.face, a.low), corner(b.face, b.low));
    fans.join(corner(a.face, a.high), corner(b.face, b.high));
  }
  std::vector<std::uint8_t> fan_count(mesh.vertices.size());
  for (std::uint32_t c = 0; c < 3 * mesh.faces.size(); ++c) {
    auto& count = fan_count[mesh.faces[c / 3][c % 3]];
    if (fans.root(c) == c && count < 2) ++count;
  }
  return static_cast<std::size_t>(std::count(fan_count.begin(), fan_count.end(), 2));
}

/// A flag per face: of the component that encloses the largest volume.
std::vector<bool> largest_faces(const Mesh& mesh) {
  const Components parts = components(mesh);
  std::vector<double> volume(parts.count);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    volume[parts.of_face[f]] +=
        mesh.vertices[a].cast<double>().dot(mesh.vertices[b].cast<double>().cross(mesh.vertices[c].cast<double>()));
  }
  const auto largest = static_cast<std::uint32_t>(std::max_element(volume.begin(), volume.end()) - volume.begin());
  std::vector<bool> keep(mesh.faces.size());
  for (std::size_t f = 0; f < keep.size(); ++f) keep[f] = parts.of_face[f] == largest;
  return keep;
}

}  // namespace

Components components(const Mesh& mesh) {
  DisjointSets sets(mesh.vertices.size());
  for (const auto& f : mesh.faces) {
    sets.join(f[0], f[1]);
    sets.join(f[1], f[2]);
  }
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
  Components result;
  result.of_face.reserve(mesh.faces.size());
  for (const auto& f : mesh.faces) {
    auto& n = number[sets.root(f[0])];
    if (n == kNone) n = static_cast<std::uint32_t>(result.count++);
    result.of_face.push_back(n);
  }
  return result;
}

Topology topology(const Mesh& mesh) {
  Topology result;
  result.components = components(mesh).count;
  const std::vector<Edge> edges = sorted_edges(mesh);
  long edge_count = 0;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    ++edge_count;
    if (end - i == 1) ++result.boundary_edges;
    if (end - i > 2 || (end - i == 2 && edges[i].forward == edges[i + 1].forward)) ++result.non_manifold_edges;
    i = end;
  }
  std::vector<bool> used(mesh.vertices.size());
  for (const auto& f : mesh.faces) {
    if (is_degenerate(f)) ++result.degenerate_faces;
    for (const auto v : f) used[v] = true;
  }
  result.non_manifold_vertices = count_split_vertices(mesh, edges);
  result.euler =
      static_cast<long>(std::count(used.begin(), used.end(), true)) - edge_count + static_cast<long>(mesh.faces.size());
  return result;
}

Mesh kept_faces(const Mesh& mesh, const std::vector<bool>& keep) {
  std::vector<std::uint32_t> new_index(mesh.vertices.size(), 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (keep[f]) {
      for (const auto v : mesh.faces[f]) new_index[v] = 1;
    }
  }
  const auto kept = static_cast<std::size_t>(std::ranges::count(new_index, 1U));
  Mesh result;
  result.vertices.reserve(kept);
  result.faces.reserve(static_cast<std::size_t>(std::ranges::count(keep, true)));
  const auto copy = [](const auto& from, auto& to, std::size_t i) {
    if (!from.empty()) to.push_back(from[i]);
  };
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (new_index[v] == 0) continue;
    new_index[v] = count++;
    copy(mesh.vertices, result.vertices, v);
    copy(mesh.normals, result.normals, v);
    copy(mesh.views, result.views, v);
    copy(mesh.sigma, result.sigma, v);
    copy(mesh.colour, result.colour, v);
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    if (keep[f]) result.faces.push_back({new_index[a], new_index[b], new_index[c]});
  }
  return result;
}

Mesh joined_vertices(const Mesh& mesh) {
  const auto before = [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::vector<std::uint32_t> order(mesh.vertices.size()), place(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, [&](auto a, auto b) { return before(mesh.vertices[a], mesh.vertices[b]); });
  Mesh joined;
  for (const auto v : order) {
    if (joined.vertices.empty() || joined.vertices.back() != mesh.vertices[v])
      joined.vertices.push_back(mesh.vertices[v]);
    place[v] = static_cast<std::uint32_t>(joined.vertices.size() - 1);
  }
  for (const auto& [a, b, c] : mesh.faces) {
    const Mesh::Face face{place[a], place[b], place[c]};
    if (!is_degenerate(face)) joined.faces.push_back(face);
  }
  return joined;
}

long genus_of_largest(const Mesh& mesh) {
  if (mesh.faces.empty()) return 0;
  const std::vector<bool> keep = largest_faces(mesh);
  std::vector<bool> used(mesh.vertices.size());
  for (std::size_t f = 0; f < keep.size(); ++f) {
    if (!keep[f]) continue;
    for (const auto v : mesh.faces[f]) used[v] = true;
  }
  const auto vertices = static_cast<long>(std::ranges::count(used, true));
  const auto faces = static_cast<long>(std::ranges::count(keep, true));
  return 1 - (vertices - faces / 2) / 2;  // three edges for two faces
}

Mesh largest_component(const Mesh& mesh) { return kept_faces(mesh, largest_faces(mesh)); }

}  // namespace scanrig
