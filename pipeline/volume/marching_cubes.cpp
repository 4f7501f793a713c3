#include "pipeline/volume/marching_cubes.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr int kCorners = kBlockSide + 1;  // nodes along a block's cells, the next block's first included
constexpr float kNearestToNode = 0.1F;    // of a cut edge

/// The edge between two corners that differ in one coordinate.
int edge_between(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  const int low = a & b;
  const int others = axis == 0 ? low >> 1 : axis == 1 ? (low & 1) | (low >> 1 & 2) : low & 3;
  return 4 * axis + others;
}

/// Corner at which an edge starts.
int edge_start(int edge) {
  const int axis = edge / 4, k = edge % 4;
  return axis == 0 ? k << 1 : axis == 1 ? (k & 1) | (k & 2) << 1 : k;
}

/// Corners of a face, counter-clockwise seen from outside the cell. Faces: 2 axis + side.
std::array<int, 4> face_corners(int face) {
  const int axis = face / 2, side = face % 2;
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

bool on_common_face(int edge_a, int edge_b) {
  for (int face = 0; face < 6; ++face) {
    const auto corners = face_corners(face);
    const auto holds = [&](int edge) {
      for (int i = 0; i < 4; ++i) {
        if (edge_between(corners[i], corners[(i + 1) % 4]) == edge) return true;
      }
      return false;
    };
    if (holds(edge_a) && holds(edge_b)) return true;
  }
  return false;
}

/// For every cut edge the next one around its polygon. On each face a cut separates one run of outside corners.
std::array<int, 12> polygon_links(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (int face = 0; face < 6; ++face) {
    const auto corners = face_corners(face);
    const auto is_inside = [&](int i) { return (inside >> corners[i % 4] & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
      if (!is_inside(i) || is_inside(i + 1)) continue;  // the run of outside corners starts at i + 1
      int last = i + 1;
      while (!is_inside(last + 1)) ++last;
      const int enters = edge_between(corners[i], corners[(i + 1) % 4]);
      const int leaves = edge_between(corners[last % 4], corners[(last + 1) % 4]);
      next[leaves] = enters;
    }
  }
  return next;
}

/// Splits a polygon into triangles so that no diagonal lies on a cell face. Returns false if that is impossible.
bool triangulate(const std::vector<int>& polygon, CaseTriangles& triangles) {
  const std::size_t n = polygon.size();
  if (n == 3) {
    triangles.push_back({static_cast<std::uint8_t>(polygon[0]), static_cast<std::uint8_t>(polygon[1]),
                         static_cast<std::uint8_t>(polygon[2])});
    return true;
  }
  for (std::size_t i = 0; i < n; ++i) {  // cut off the ear at i
    const int before = polygon[(i + n - 1) % n], after = polygon[(i + 1) % n];
    if (on_common_face(before, after)) continue;
    std::vector<int> rest = polygon;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t done = triangles.size();
    if (triangulate({before, polygon[i], after}, triangles) && triangulate(rest, triangles)) return true;
    triangles.resize(done);
  }
  return false;
}

CaseTriangles make_case(int inside) {
  CaseTriangles triangles;
  std::array<int, 12> next = polygon_links(inside);
  for (int start = 0; start < 12; ++start) {
    std::vector<int> polygon;
    for (int edge = start; next[edge] >= 0;) {
      polygon.push_back(edge);
      edge = std::exchange(next[edge], -1);
    }
    if (!polygon.empty() && !triangulate(polygon, triangles)) std::abort();  // a test visits every case
  }
  return triangles;
}

/// Distances at the corners of a block's cells.
using Corners = std::array<float, kCorners * kCorners * kCorners>;
int corner(const Eigen::Vector3i& n) { return (n.z() * kCorners + n.y()) * kCorners + n.x(); }
int node(const Eigen::Vector3i& n) { return BlockGrid::Block::node(n.x(), n.y(), n.z()); }

/// Calls `body` for the cells of a block, each by its first corner.
template <class Body>
void for_each_node(int side, const Body& body) {
  Eigen::Vector3i n;
  for (n.z() = 0; n.z() < side; ++n.z()) {
    for (n.y() = 0; n.y() < side; ++n.y()) {
      for (n.x() = 0; n.x() < side; ++n.x()) body(n);
    }
  }
}

/// A block and the seven that follow it; a block that is not stored is null.
struct Octet {
  std::array<const BlockGrid::Block*, 8> block;
  std::array<std::size_t, 8> place;  ///< of the stored blocks in the grid's
  std::array<float, 8> constant;     ///< distance in the blocks that are not stored

  Octet(const BlockGrid& grid, const Eigen::Vector3i& first) {
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3i index = first + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2 & 1);
      block[i] = grid.find(index);
      place[i] = block[i] == nullptr ? 0 : grid.place(index);
      constant[i] = grid.all_inside(index) ? -1.0F : 1.0F;
    }
  }
  static int which(const Eigen::Vector3i& n) {
    return (n.x() == kBlockSide ? 1 : 0) | (n.y() == kBlockSide ? 2 : 0) | (n.z() == kBlockSide ? 4 : 0);
  }
  [[nodiscard]] float distance(const Eigen::Vector3i& n) const {
    const int i = which(n);
    return block[i] == nullptr ? constant[i]
                               : block[i]->distance[node(n.unaryExpr([](int c) { return c % kBlockSide; }))];
  }
};

/// Vertices on the edges that start in one block, in the order of the edges, 3 node + axis: a bit an edge, and the
/// number of those before each word. A number for every edge would be more than all else of a fine grid.
class BlockVertices {
 public:
  std::vector<Eigen::Vector3f> positions;

  void mark(int edge) { is_cut_[edge / 64] |= std::uint64_t{1} << (edge % 64); }
  void count() {
    for (std::size_t word = 1; word < kWords; ++word) {
      before_[word] = static_cast<std::uint16_t>(before_[word - 1] + std::popcount(is_cut_[word - 1]));
    }
  }
  [[nodiscard]] std::uint32_t number(int edge) const {
    const std::uint64_t below = (std::uint64_t{1} << (edge % 64)) - 1;
    return static_cast<std::uint32_t>(before_[edge / 64] + std::popcount(is_cut_[edge / 64] & below));
  }

 private:
  static constexpr std::size_t kWords = 3 * BlockGrid::kNodes / 64;
  std::array<std::uint64_t, kWords> is_cut_{};
  std::array<std::uint16_t, kWords> before_{};
};

BlockVertices cut_edges(const BlockGrid& grid, const BlockGrid::Block& block) {
  const Octet octet(grid, block.index);
  BlockVertices result;
  for_each_node(kBlockSide, [&](const Eigen::Vector3i& n) {
    const float here = octet.distance(n);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i step = Eigen::Vector3i::Unit(axis);
      const float there = octet.distance(n + step);
      if ((here < 0.0F) == (there < 0.0F)) continue;
      result.mark(3 * node(n) + axis);
      // Away from the nodes, so that no triangle is so small that noise decides its normal.
      const float t = std::clamp(here / (here - there), kNearestToNode, 1.0F - kNearestToNode);
      result.positions.push_back(grid.position(kBlockSide * block.index + n) + grid.voxel() * t * step.cast<float>());
    }
  });
  result.count();
  return result;
}

struct Numbering {
  const BlockGrid& grid;
  const std::vector<BlockVertices>& vertices;
  std::vector<std::uint32_t> first;  ///< of each block
};

std::vector<Mesh::Face> cell_faces(const Numbering& numbering, const Eigen::Vector3i& index) {
  const Octet octet(numbering.grid, index);
  Corners distance;
  for_each_node(kCorners, [&](const Eigen::Vector3i& n) { distance[corner(n)] = octet.distance(n); });
  std::vector<Mesh::Face> faces;
  const auto vertex = [&](const Eigen::Vector3i& cell, int edge) {
    const int start = edge_start(edge);
    const Eigen::Vector3i n = cell + Eigen::Vector3i(start & 1, start >> 1 & 1, start >> 2 & 1);
    const std::size_t slot = octet.place[Octet::which(n)];
    const int local = node(n.unaryExpr([](int c) { return c % kBlockSide; }));
    return numbering.first[slot] + numbering.vertices[slot].number(3 * local + edge / 4);
  };
  for_each_node(kBlockSide, [&](const Eigen::Vector3i& cell) {
    unsigned inside = 0;
    for (unsigned c = 0; c < 8; ++c) {
      const Eigen::Vector3i n = cell + Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2 & 1);
      inside |= distance[corner(n)] < 0.0F ? 1U << c : 0U;
    }
    for (const auto& t : marching_cubes_cases()[inside]) {
      faces.push_back({vertex(cell, t[0]), vertex(cell, t[1]), vertex(cell, t[2])});
    }
  });
  return faces;
}

/// The stored blocks and those just before them, whose last cells reach into a stored block.
std::vector<Eigen::Vector3i> blocks_with_cells(const BlockGrid& grid) {
  std::vector<Eigen::Vector3i> result;
  for (const auto& block : grid.blocks()) {
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3i index = block.index - Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2 & 1);
      if (i == 0 || grid.find(index) == nullptr) result.push_back(index);
    }
  }
  const auto less = [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::sort(result.begin(), result.end(), less);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace

const std::array<CaseTriangles, 256>& marching_cubes_cases() {
  static const auto cases = [] {
    std::array<CaseTriangles, 256> all;
    for (int inside = 0; inside < 256; ++inside) all[inside] = make_case(inside);
    return all;
  }();
  return cases;
}

Mesh extract_surface(const BlockGrid& grid) {
  std::vector<BlockVertices> vertices(grid.blocks().size());
  parallel_for(vertices.size(), [&](std::size_t i) { vertices[i] = cut_edges(grid, grid.blocks()[i]); });
  Numbering numbering{grid, vertices, {}};
  Mesh mesh;
  std::size_t count = 0;
  for (const auto& block : vertices) count += block.positions.size();
  mesh.vertices.reserve(count);
  for (auto& block : vertices) {
    numbering.first.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
    mesh.vertices.insert(mesh.vertices.end(), block.positions.begin(), block.positions.end());
    block.positions = std::vector<Eigen::Vector3f>();
  }
  const std::vector<Eigen::Vector3i> cells = blocks_with_cells(grid);
  std::vector<std::vector<Mesh::Face>> faces(cells.size());
  parallel_for(cells.size(), [&](std::size_t i) { faces[i] = cell_faces(numbering, cells[i]); });
  count = 0;
  for (const auto& part : faces) count += part.size();
  mesh.faces.reserve(count);
  for (auto& part : faces) {
    mesh.faces.insert(mesh.faces.end(), part.begin(), part.end());
    part = std::vector<Mesh::Face>();
  }
  return mesh;
}

}  // namespace scanrig
