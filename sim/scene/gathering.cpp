#include "sim/scene/gathering.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanrig::sim {

std::vector<Eigen::Vector3d> hemisphere(int count) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double r = std::sqrt((i + 0.5) / count), phi = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), std::sqrt(1.0 - r * r));
  }
  return directions;
}

TableGrid::Place TableGrid::place(double x, double z) {
  const double u = std::clamp(x / kStep + kMiddle, 0.0, kAcross - 1.001);
  const double v = std::clamp(z / kStep + kMiddle, 0.0, kAcross - 1.001);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  return {i, j, static_cast<float>(u - i), static_cast<float>(v - j)};
}

}  // namespace scanrig::sim
