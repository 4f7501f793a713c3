#pragma once

#include <Eigen/Core>
#include <vector>

namespace scanrig::sim {

/// Directions over the hemisphere around +Z, spread evenly under the cosine law.
std::vector<Eigen::Vector3d> hemisphere(int count);

/// A frame whose +Z is `normal` (unit).
inline Eigen::Matrix3d frame_around(const Eigen::Vector3d& normal) {
  Eigen::Matrix3d frame;
  frame << normal.unitOrthogonal(), normal.cross(normal.unitOrthogonal()), normal;
  return frame;
}

/// One step of averaging over the edges: removes the grain of few rays.
template <class Value>
void average_with_neighbours(const std::vector<Eigen::Vector3i>& triangles, std::vector<Value>& values) {
  std::vector<Value> sum = values;
  std::vector<float> count(values.size(), 1.0F);
  for (const auto& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      sum[t[i]] += values[t[(i + 1) % 3]];
      count[t[i]] += 1.0F;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = sum[i] / count[i];
}

/// Nodes over the table on which light is gathered, in the table's own (turning) frame.
struct TableGrid {
  static constexpr int kAcross = 73;
  static constexpr int kMiddle = kAcross / 2;
  static constexpr double kStep = 2.5;  ///< mm between them

  static Eigen::Vector3d node(int column, int row) {
    return {kStep * (column - kMiddle), 0.0, kStep * (row - kMiddle)};
  }
  /// A place between nodes (column, row) and (column + 1, row + 1).
  struct Place {
    int column, row;
    float along, down;

    template <class Value>
    [[nodiscard]] Value mixed(const Value& a, const Value& b, const Value& c, const Value& d) const {
      return (1.0F - down) * ((1.0F - along) * a + along * b) + down * ((1.0F - along) * c + along * d);
    }
  };
  static Place place(double x, double z);
};

}  // namespace scanrig::sim
