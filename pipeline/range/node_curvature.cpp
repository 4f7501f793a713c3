#include "pipeline/range/node_curvature.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr int kNodesAround = 2;  // to each side
constexpr int kFewestNodes = 12;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::array<float, 3> curvature_at(const Nodes& nodes, int column, int row, const StereoOptions& options) {
  const DisparityPatch& node = nodes.at(column, row);
  if (!node.valid) return {};
  Matrix6 normal = Matrix6::Zero();
  Vector6 rhs = Vector6::Zero();
  double squares = 0.0;
  int count = 0;
  for (int dy = -kNodesAround; dy <= kNodesAround; ++dy) {
    for (int dx = -kNodesAround; dx <= kNodesAround; ++dx) {
      const int other_column = column + dx, other_row = row + dy;
      if (other_column < 0 || other_row < 0 || other_column >= nodes.columns || other_row >= nodes.rows) continue;
      const DisparityPatch& other = nodes.at(other_column, other_row);
      if (!other.valid) continue;
      const auto x = static_cast<float>(dx * nodes.stride), y = static_cast<float>(dy * nodes.stride);
      // Each predicts the other: one surface.
      if (std::abs(node.at(x, y) - other.c[0]) > options.surface_px ||
          std::abs(other.at(-x, -y) - node.c[0]) > options.surface_px) {
        continue;
      }
      const double x_unit = dx, y_unit = dy;  // strides
      Vector6 shape;
      shape << 1.0, x_unit, y_unit, x_unit * x_unit, x_unit * y_unit, y_unit * y_unit;
      normal += shape * shape.transpose();
      const auto disparity = static_cast<double>(other.c[0] - node.c[0]);
      rhs += shape * disparity;
      squares += disparity * disparity;
      ++count;
    }
  }
  if (count < kFewestNodes) return {};
  const Eigen::LDLT<Matrix6> solver(normal);
  if (solver.info() != Eigen::Success || solver.rcond() < 1e-6) return {};
  const Vector6 fitted = solver.solve(rhs);
  const Matrix6 inverse = solver.solve(Matrix6::Identity());
  // The windows of neighbouring nodes overlap, so their errors are shared: this many nodes count as one.
  const int side = 2 * options.sharp_radii_px.front() + 1;
  const double overlap = static_cast<double>(side * side) / (nodes.stride * nodes.stride);
  const double noise = overlap * std::max(0.0, squares - rhs.dot(fitted)) / (count - 6);
  std::array<float, 3> curvature{};
  for (int i = 0; i < 3; ++i) {
    const double value = fitted[3 + i], variance = noise * inverse(3 + i, 3 + i);
    const double unit = nodes.stride * nodes.stride;
    curvature[static_cast<std::size_t>(i)] =
        static_cast<float>(value * value * value / (value * value + variance) / unit);
  }
  return curvature;
}

}  // namespace

std::vector<std::array<float, 3>> node_curvature(const Nodes& nodes, const StereoOptions& options) {
  std::vector<std::array<float, 3>> curvature(nodes.patches.size());
  parallel_for(static_cast<std::size_t>(nodes.rows), [&](std::size_t index) {
    const int row = static_cast<int>(index);
    for (int column = 0; column < nodes.columns; ++column) {
      curvature[index * static_cast<std::size_t>(nodes.columns) + static_cast<std::size_t>(column)] =
          curvature_at(nodes, column, row, options);
    }
  });
  return curvature;
}

}  // namespace scanrig
