#include "tests/bench/pose/campaign_solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>

namespace scanrig::campaign {
namespace {

constexpr double kReachMm = 75.0;
constexpr int kBlockCells = 8;
constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};

double share_along(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::clamp((p - a).dot(b - a) / std::max((b - a).squaredNorm(), 1e-12), 0.0, 1.0);
}

/// The signed distance at the points of a grid; only near the surface it is exact.
class DistanceGrid {
 public:
  DistanceGrid(const Distance& solid, double cell_mm)
      : cell_(cell_mm), blocks_(static_cast<int>(std::ceil(2.0 * kReachMm / (cell_mm * kBlockCells)))) {
    count_ = blocks_ * kBlockCells + 1;
    value_.resize(static_cast<std::size_t>(count_) * count_ * count_, 1.0F);
    for (int b = 0; b < blocks_ * blocks_ * blocks_; ++b) fill_block(solid, b);
  }
  [[nodiscard]] int blocks() const { return blocks_; }
  [[nodiscard]] const std::vector<int>& near_surface() const { return near_; }
  [[nodiscard]] std::array<int, 3> first_of(int block) const {
    return {block % blocks_ * kBlockCells, block / blocks_ % blocks_ * kBlockCells,
            block / (blocks_ * blocks_) * kBlockCells};
  }
  [[nodiscard]] std::size_t id(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * count_ + y) * count_ + x;
  }
  [[nodiscard]] double value(std::size_t id) const { return static_cast<double>(value_[id]); }
  [[nodiscard]] Eigen::Vector3d at(std::size_t id) const {
    const Eigen::Vector3d off_flat_faces(0.013, 0.017, 0.011);  // these have round numbers
    const auto n = static_cast<std::size_t>(count_);
    const std::size_t x = id % n, y = id / n % n, z = id / n / n;
    const Eigen::Vector3d node(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
    return cell_ * (node + off_flat_faces) - Eigen::Vector3d::Constant(kReachMm);
  }

 private:
  void fill_block(const Distance& solid, int block) {
    const auto [x0, y0, z0] = first_of(block);
    const Eigen::Vector3d middle = at(id(x0, y0, z0)) + Eigen::Vector3d::Constant(0.5 * kBlockCells * cell_);
    const double distance = solid(middle);
    const bool is_near = std::abs(distance) < 0.9 * kBlockCells * cell_;
    if (is_near) near_.push_back(block);
    for (int z = z0; z <= z0 + kBlockCells; ++z) {
      for (int y = y0; y <= y0 + kBlockCells; ++y) {
        for (int x = x0; x <= x0 + kBlockCells; ++x) {
          value_[id(x, y, z)] = static_cast<float>(is_near ? solid(at(id(x, y, z))) : distance);
        }
      }
    }
  }

  double cell_;
  int blocks_, count_ = 0;
  std::vector<float> value_;
  std::vector<int> near_;
};

class Mesher {
 public:
  explicit Mesher(const DistanceGrid& grid) : grid_(grid) {}

  Mesh mesh() {
    for (const int block : grid_.near_surface()) {
      const auto [x0, y0, z0] = grid_.first_of(block);
      for (int z = z0; z < z0 + kBlockCells; ++z) {
        for (int y = y0; y < y0 + kBlockCells; ++y) {
          for (int x = x0; x < x0 + kBlockCells; ++x) add_cell(x, y, z);
        }
      }
    }
    return std::move(mesh_);
  }

 private:
  void add_cell(int x, int y, int z) {
    for (const auto& tetrahedron : kTetrahedra) {
      std::array<std::size_t, 4> in{}, out{};
      int ins = 0, outs = 0;
      for (const int c : tetrahedron) {
        const std::size_t id = grid_.id(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2));
        (grid_.value(id) < 0.0 ? in[ins++] : out[outs++]) = id;
      }
      if (ins == 1) add(vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2]), in[0], out[0]);
      if (ins == 3) add(vertex(in[0], out[0]), vertex(in[1], out[0]), vertex(in[2], out[0]), in[0], out[0]);
      if (ins == 2) {
        const auto a = vertex(in[0], out[0]), b = vertex(in[0], out[1]);
        const auto c = vertex(in[1], out[1]), d = vertex(in[1], out[0]);
        add(a, b, c, in[0], out[0]);
        add(a, c, d, in[0], out[0]);
      }
    }
  }
  std::uint32_t vertex(std::size_t in, std::size_t out) {
    const auto [it, fresh] =
        known_.try_emplace((static_cast<std::uint64_t>(in) << 32) | out, static_cast<std::uint32_t>(known_.size()));
    if (fresh) {
      const double t = grid_.value(in) / (grid_.value(in) - grid_.value(out));
      mesh_.vertices.push_back((grid_.at(in) + t * (grid_.at(out) - grid_.at(in))).cast<float>());
    }
    return it->second;
  }
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::size_t in, std::size_t out) {
    const Eigen::Vector3f& v = mesh_.vertices[a];
    const Eigen::Vector3f n = (mesh_.vertices[b] - v).cross(mesh_.vertices[c] - v);
    // The corner that is farther from the plane says which side is which; one of them may lie on it.
    const float to_out = n.dot(grid_.at(out).cast<float>() - v), to_in = n.dot(grid_.at(in).cast<float>() - v);
    mesh_.faces.push_back(to_out > to_in ? Mesh::Face{a, b, c} : Mesh::Face{a, c, b});
  }

  const DistanceGrid& grid_;
  std::unordered_map<std::uint64_t, std::uint32_t> known_;
  Mesh mesh_;
};

void move_onto(const Distance& solid, double max_mm, Mesh& mesh) {
  constexpr double kStep = 1e-3;
  for (Eigen::Vector3f& vertex : mesh.vertices) {
    Eigen::Vector3d p = vertex.cast<double>();
    const Eigen::Vector3d start = p;
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d slope;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d e = kStep * Eigen::Vector3d::Unit(axis);
        slope[axis] = (solid(p + e) - solid(p - e)) / (2.0 * kStep);
      }
      if (slope.squaredNorm() < 0.25) break;  // an edge
      p -= solid(p) * slope / slope.squaredNorm();
    }
    if ((p - start).norm() < max_mm) vertex = p.cast<float>();
  }
}

}  // namespace

Distance rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  const Eigen::Vector3d axis = (b - a).normalized(), middle = 0.5 * (a + b);
  const double half = 0.5 * (b - a).norm();
  return [=](const Eigen::Vector3d& p) {
    const double along = (p - middle).dot(axis);
    const Eigen::Vector2d d((p - middle - along * axis).norm() - radius, std::abs(along) - half);
    return d.cwiseMax(0.0).norm() + std::min(d.maxCoeff(), 0.0);
  };
}

Distance chain(std::vector<Eigen::Vector3d> points, std::vector<double> radii) {
  return [points = std::move(points), radii = std::move(radii)](const Eigen::Vector3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const double t = share_along(p, points[i], points[i + 1]);
      const double radius = radii[i] + t * (radii[i + 1] - radii[i]);
      nearest = std::min(nearest, (p - points[i] - t * (points[i + 1] - points[i])).norm() - radius);
    }
    return nearest;
  };
}

Distance ring(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double radius, double thickness) {
  return [=, axis = Eigen::Vector3d(axis.normalized())](const Eigen::Vector3d& p) {
    const double along = (p - centre).dot(axis);
    return std::hypot((p - centre - along * axis).norm() - radius, along) - thickness;
  };
}

Distance half_space(const Eigen::Vector3d& normal, double offset) {
  return [=](const Eigen::Vector3d& p) { return normal.dot(p) - offset; };
}

Distance united(std::vector<Distance> parts) {
  return [parts = std::move(parts)](const Eigen::Vector3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Distance& part : parts) nearest = std::min(nearest, part(p));
    return nearest;
  };
}

Distance blended(std::vector<Distance> parts, double fillet_mm) {
  return [=, parts = std::move(parts)](const Eigen::Vector3d& p) {
    double sum = parts[0](p);
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const double next = parts[i](p);
      const double near = std::max(fillet_mm - std::abs(sum - next), 0.0) / fillet_mm;
      sum = std::min(sum, next) - 0.25 * fillet_mm * near * near;
    }
    return sum;
  };
}

Distance without(Distance solid, Distance hole) {
  return [solid = std::move(solid), hole = std::move(hole)](const Eigen::Vector3d& p) {
    return std::max(solid(p), -hole(p));
  };
}

Distance common(std::vector<Distance> parts) {
  return [parts = std::move(parts)](const Eigen::Vector3d& p) {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Distance& part : parts) farthest = std::max(farthest, part(p));
    return farthest;
  };
}

Mesh mesh_of_solid(const Distance& solid, double cell_mm) {
  const DistanceGrid grid(solid, cell_mm);
  Mesh mesh = Mesher(grid).mesh();
  move_onto(solid, 0.3 * cell_mm, mesh);
  return mesh;
}

}  // namespace scanrig::campaign
