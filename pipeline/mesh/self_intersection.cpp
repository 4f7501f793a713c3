#include "pipeline/mesh/self_intersection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/parallel_blocks.h"

namespace scanrig {
namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Six times the signed volume of a tetrahedron.
double volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t) {
  if (volume(t[0], t[1], t[2], p) * volume(t[0], t[1], t[2], q) >= 0.0) return false;
  const double u = volume(p, q, t[0], t[1]), v = volume(p, q, t[1], t[2]), w = volume(p, q, t[2], t[0]);
  return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

/// Whether `b` lies on one side of the plane of `a`.
bool is_beside(const Triangle& a, const Triangle& b) {
  const double first = volume(a[0], a[1], a[2], b[0]);
  return first * volume(a[0], a[1], a[2], b[1]) > 0.0 && first * volume(a[0], a[1], a[2], b[2]) > 0.0;
}

/// Two triangles cross if an edge of one crosses the other.
bool cross(const Triangle& a, const Triangle& b) {
  if (is_beside(a, b) || is_beside(b, a)) return false;
  for (int k = 0; k < 3; ++k) {
    if (crosses(a[k], a[(k + 1) % 3], b) || crosses(b[k], b[(k + 1) % 3], a)) return true;
  }
  return false;
}

Triangle triangle_of(const Mesh& mesh, const Mesh::Face& face) {
  return {mesh.vertices[face[0]].cast<double>(), mesh.vertices[face[1]].cast<double>(),
          mesh.vertices[face[2]].cast<double>()};
}

bool share_vertex(const Mesh::Face& a, const Mesh::Face& b) {
  return std::any_of(a.begin(), a.end(), [&b](std::uint32_t v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

using Box = Eigen::AlignedBox3f;

/// Ten bits, two places apart.
std::uint64_t spread(std::uint32_t bits) {
  std::uint64_t result = 0;
  for (int k = 0; k < 10; ++k) result |= static_cast<std::uint64_t>((bits >> k) & 1U) << (3 * k);
  return result;
}

/// Numbers of the faces along a Z-order curve, so that neighbours in the list are neighbours in space.
std::vector<std::uint32_t> along_curve(const Mesh& mesh) {
  Box all;
  for (const auto& vertex : mesh.vertices) all.extend(vertex);
  const float scale = 1023.0F / std::max(all.sizes().maxCoeff(), std::numeric_limits<float>::min());
  std::vector<std::uint64_t> keys(mesh.faces.size());
  for_each_in_blocks(keys.size(), [&](std::size_t f) {
    const Eigen::Vector3f at = scale * (mesh.vertices[mesh.faces[f][0]] - all.min());
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k) key |= spread(static_cast<std::uint32_t>(at[k])) << k;
    keys[f] = key << 32U | f;
  });
  std::sort(keys.begin(), keys.end());
  return {keys.begin(), keys.end()};
}

/// Which faces of a mesh cross: boxes of neighbours along the curve in a binary tree, held against each other level by
/// level.
class Crossings {
 public:
  Crossings(const Mesh& mesh, const std::vector<bool>& is_moved) : mesh_(mesh), faces_(along_curve(mesh)) {
    while (leaves_ * kLeaf < faces_.size()) leaves_ *= 2;
    boxes_.resize(faces_.size());
    moved_.assign(faces_.size(), is_moved.empty() ? 1 : 0);
    nodes_.resize(2 * leaves_);
    for_each_in_blocks(leaves_, [&](std::size_t leaf) {
      Node& node = nodes_[leaves_ + leaf];
      for (std::size_t i = leaf * kLeaf; i < end_of(leaf); ++i) {
        for (const std::uint32_t v : mesh.faces[faces_[i]]) {
          boxes_[i].extend(mesh.vertices[v]);
          if (!is_moved.empty() && is_moved[v]) moved_[i] = 1;
        }
        node.box.extend(boxes_[i]);
        node.has_moved |= moved_[i] != 0;
      }
    });
    for (std::size_t n = leaves_ - 1; n > 0; --n) {
      for (const Node* child : {&nodes_[2 * n], &nodes_[2 * n + 1]}) {
        nodes_[n].box.extend(child->box);
        nodes_[n].has_moved |= child->has_moved;
      }
    }
  }

  /// In order, each once.
  [[nodiscard]] std::vector<std::uint32_t> faces() const {
    constexpr std::size_t kTasks = 1000;
    std::vector<Pair> pairs = {{1, 1}};
    while (pairs.size() < kTasks && !pairs.empty() && pairs.front().first < leaves_) {
      std::vector<Pair> below;
      for (const Pair& pair : pairs) for_children(pair, [&](const Pair& child) { below.push_back(child); });
      pairs = std::move(below);
    }
    std::vector<std::vector<std::uint32_t>> found(pairs.size());
    parallel_for(pairs.size(), [&](std::size_t i) { descend(pairs[i], found[i]); });
    std::vector<std::uint32_t> all;
    for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

 private:
  struct Node {
    Box box;  ///< empty: no faces
    bool has_moved = false;
  };
  using Pair = std::pair<std::size_t, std::size_t>;  ///< of nodes of one level
  static constexpr std::size_t kLeaf = 8;            ///< faces

  [[nodiscard]] std::size_t end_of(std::size_t leaf) const { return std::min(faces_.size(), (leaf + 1) * kLeaf); }

  /// Calls `visit` with the pairs one level below that may hold faces to compare, each once.
  template <class Visit>
  void for_children(const Pair& pair, const Visit& visit) const {
    for (std::size_t a = 2 * pair.first; a <= 2 * pair.first + 1; ++a) {
      for (std::size_t b = 2 * pair.second; b <= 2 * pair.second + 1; ++b) {
        if (a > b || !(nodes_[a].has_moved || nodes_[b].has_moved)) continue;
        if (nodes_[a].box.intersects(nodes_[b].box)) visit(Pair{a, b});
      }
    }
  }

  void descend(const Pair& pair, std::vector<std::uint32_t>& found) const {
    if (pair.first >= leaves_) return compare(pair.first - leaves_, pair.second - leaves_, found);
    for_children(pair, [&](const Pair& child) { descend(child, found); });
  }

  void compare(std::size_t a, std::size_t b, std::vector<std::uint32_t>& found) const {
    for (std::size_t i = a * kLeaf; i < end_of(a); ++i) {
      if (!boxes_[i].intersects(nodes_[leaves_ + b].box)) continue;
      for (std::size_t j = a == b ? i + 1 : b * kLeaf; j < end_of(b); ++j) {
        if (!(moved_[i] != 0 || moved_[j] != 0) || !boxes_[i].intersects(boxes_[j])) continue;
        const Mesh::Face &mine = mesh_.faces[faces_[i]], &other = mesh_.faces[faces_[j]];
        if (share_vertex(mine, other) || !cross(triangle_of(mesh_, mine), triangle_of(mesh_, other))) continue;
        found.push_back(faces_[i]);
        found.push_back(faces_[j]);
      }
    }
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> faces_;  ///< along the curve, as boxes_ and moved_
  std::vector<Box> boxes_;
  std::vector<std::uint8_t> moved_;
  std::size_t leaves_ = 1;   ///< a power of two
  std::vector<Node> nodes_;  ///< the root is 1, the children of n are 2 n and 2 n + 1, the leaves come last
};

}  // namespace

std::vector<std::uint32_t> self_intersecting_faces(const Mesh& mesh, const std::vector<bool>& is_moved) {
  return Crossings(mesh, is_moved).faces();
}

}  // namespace scanrig
