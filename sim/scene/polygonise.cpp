#include "sim/scene/polygonise.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Field = std::function<double(const Vector3d&)>;

constexpr int kBlock = 8;  // cells along a block's edge

/// A vertex is identified by its lattice edge: the node it starts from and one of the cube's seven directions.
using EdgeKey = std::uint64_t;

struct Lattice {
  Vector3d origin;
  double cell;
  Vector3i blocks;

  [[nodiscard]] Vector3d node(const Vector3i& n) const { return origin + cell * n.cast<double>(); }
  [[nodiscard]] static EdgeKey key(const Vector3i& n, int direction) {
    return ((static_cast<EdgeKey>(n.x()) << 20 | static_cast<EdgeKey>(n.y())) << 20 | static_cast<EdgeKey>(n.z()))
               << 3 |
           static_cast<EdgeKey>(direction);
  }
  [[nodiscard]] Vector3d vertex(EdgeKey key, const Field& field) const {
    const int d = static_cast<int>(key & 7);
    const auto part = [&](int shift) { return static_cast<int>(key >> shift & 0xfffff); };
    const Vector3i n(part(43), part(23), part(3));
    Vector3d a = node(n), b = node(n + Vector3i(d & 1, d >> 1 & 1, d >> 2 & 1));
    double fa = field(a), fb = field(b);
    Vector3d at = a;
    // Regula falsi, Illinois form: five steps bring a smooth field to well below a micrometre.
    int replaced = 0;
    for (int i = 0; i < 5; ++i) {
      at = a + fa / (fa - fb) * (b - a);
      const double f = field(at);
      if (f == 0.0) break;
      if ((f < 0.0) == (fb < 0.0)) {
        b = at, fb = f, fa *= replaced < 0 ? 0.5 : 1.0, replaced = -1;
      } else {
        a = at, fa = f, fb *= replaced > 0 ? 0.5 : 1.0, replaced = 1;
      }
    }
    return at;
  }
};

/// The cube's six tetrahedra around the diagonal from corner 0 to corner 7; corner bits are x, y, z. Each is a path
/// 0 -> one axis -> two axes -> 7, so an edge always leads from a corner to one that has all its bits: the direction.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

struct BlockSurface {
  std::vector<std::array<EdgeKey, 3>> triangles;

  void add(EdgeKey a, EdgeKey b, EdgeKey c) { triangles.push_back({a, b, c}); }
};

/// Key of the edge between two corners of the cube at `base`.
EdgeKey edge_key(const Vector3i& base, int a, int b) {
  const int from = a & b;
  return Lattice::key(base + Vector3i(from & 1, from >> 1 & 1, from >> 2 & 1), a ^ b);
}

/// All six tetrahedra are listed with positive volume: det(b - a, c - a, d - a) > 0.
void add_tetrahedron(const Vector3i& base, const std::array<int, 4>& t, const std::array<double, 8>& f,
                     BlockSurface& out) {
  std::array<int, 4> in{}, outside{};
  int n_in = 0, n_out = 0;
  for (int i = 0; i < 4; ++i) (f[t[i]] < 0.0 ? in[n_in++] : outside[n_out++]) = i;
  if (n_in == 0 || n_out == 0) return;
  const auto e = [&](int i, int j) { return edge_key(base, t[i], t[j]); };
  // Parity of the order (in..., out...) as a permutation of 0123 decides on which side the triangle must look.
  std::array<int, 4> order{};
  std::copy_n(in.begin(), n_in, order.begin());
  std::copy_n(outside.begin(), n_out, order.begin() + n_in);
  int inversions = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) inversions += order[i] > order[j];
  }
  const bool even = inversions % 2 == 0;
  const auto& [p, q, r, s] = order;
  const auto add = [&](EdgeKey a, EdgeKey b, EdgeKey c) { even ? out.add(a, b, c) : out.add(a, c, b); };
  if (n_in == 1) {
    add(e(p, q), e(p, r), e(p, s));
  } else if (n_in == 3) {
    add(e(s, p), e(s, q), e(s, r));
  } else {
    add(e(p, r), e(p, s), e(q, s));
    add(e(p, r), e(q, s), e(q, r));
  }
}

void polygonise_block(const Lattice& lattice, const Vector3i& block, const Field& field, double steepness,
                      BlockSurface& out) {
  const Vector3i first = kBlock * block;
  const Vector3d middle = lattice.node(first) + Vector3d::Constant(0.5 * kBlock * lattice.cell);
  if (std::abs(field(middle)) > steepness * 0.5 * std::sqrt(3.0) * kBlock * lattice.cell) return;
  constexpr int kNodes = kBlock + 1;
  std::vector<double> value(kNodes * kNodes * kNodes);
  const auto at = [](int x, int y, int z) { return (z * kNodes + y) * kNodes + x; };
  for (int z = 0; z < kNodes; ++z) {
    for (int y = 0; y < kNodes; ++y) {
      for (int x = 0; x < kNodes; ++x) value[at(x, y, z)] = field(lattice.node(first + Vector3i(x, y, z)));
    }
  }
  for (int z = 0; z < kBlock; ++z) {
    for (int y = 0; y < kBlock; ++y) {
      for (int x = 0; x < kBlock; ++x) {
        std::array<double, 8> f{};
        int inside = 0;
        for (int c = 0; c < 8; ++c) {
          f[c] = value[at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1))];
          inside += f[c] < 0.0;
        }
        if (inside == 0 || inside == 8) continue;
        for (const auto& t : kTetrahedra) add_tetrahedron(first + Vector3i(x, y, z), t, f, out);
      }
    }
  }
}

}  // namespace

TriangleMesh polygonise(const Field& field, const Box& box, double cell, double steepness) {
  const Vector3i blocks = ((box.high - box.low) / (cell * kBlock)).array().ceil().cast<int>();
  const Lattice lattice{box.low, cell, blocks};
  std::vector<BlockSurface> surfaces(static_cast<std::size_t>(blocks.prod()));
  parallel_for(surfaces.size(), [&](std::size_t i) {
    const int n = static_cast<int>(i);
    const Vector3i block(n % blocks.x(), n / blocks.x() % blocks.y(), n / (blocks.x() * blocks.y()));
    polygonise_block(lattice, block, field, steepness, surfaces[i]);
  });
  std::vector<EdgeKey> keys;
  for (const auto& s : surfaces) {
    for (const auto& t : s.triangles) keys.insert(keys.end(), t.begin(), t.end());
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

  TriangleMesh mesh;
  mesh.vertices.resize(keys.size());
  constexpr std::size_t kChunk = 1024;
  parallel_for((keys.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kChunk; i < std::min(keys.size(), (chunk + 1) * kChunk); ++i) {
      mesh.vertices[i] = lattice.vertex(keys[i], field);
    }
  });
  const auto index = [&](EdgeKey key) {
    return static_cast<int>(std::lower_bound(keys.begin(), keys.end(), key) - keys.begin());
  };
  for (const auto& s : surfaces) {
    for (const auto& t : s.triangles) mesh.triangles.emplace_back(index(t[0]), index(t[1]), index(t[2]));
  }
  return mesh;
}

}  // namespace scanrig::sim
