#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scanrig {

/// A box of the model's space in equal bricks, along each axis as many, for work that is done place by place.
class Bricks {
 public:
  Bricks(const Eigen::AlignedBox3f& box, int per_axis) : box_(box), per_axis_(per_axis) {}

  [[nodiscard]] const Eigen::AlignedBox3f& whole() const { return box_; }
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(per_axis_) * per_axis_ * per_axis_; }
  /// A point outside of the box belongs to the brick that is nearest, roughly.
  [[nodiscard]] std::size_t of(const Eigen::Vector3f& point) const {
    const Eigen::Array3f at = (point - box_.min()).array() / box_.sizes().array() * static_cast<float>(per_axis_);
    const Eigen::Array3i i = at.max(0.0F).min(static_cast<float>(per_axis_) - 0.5F).cast<int>();
    return (static_cast<std::size_t>(i.z()) * per_axis_ + i.y()) * per_axis_ + i.x();
  }
  [[nodiscard]] Eigen::AlignedBox3f box(std::size_t brick) const {
    const auto side = static_cast<std::size_t>(per_axis_);
    const std::size_t row = brick / side, layer = row / side;
    const Eigen::Array3f size = box_.sizes().array() / static_cast<float>(per_axis_);
    const Eigen::Array3f i(static_cast<float>(brick % side), static_cast<float>(row % side), static_cast<float>(layer));
    const Eigen::Vector3f low = (box_.min().array() + i * size).matrix();
    return {low, (low.array() + size).matrix()};
  }

  /// The numbers [0, count), brick by brick, in rising order; `point_of(i)` is where i belongs.
  template <class PointOf>
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> sorted(std::size_t count, const PointOf& point_of) const {
    std::vector<std::vector<std::uint32_t>> of_brick(this->count());
    for (std::size_t i = 0; i < count; ++i) of_brick[of(point_of(i))].push_back(static_cast<std::uint32_t>(i));
    return of_brick;
  }

 private:
  Eigen::AlignedBox3f box_;
  int per_axis_;
};

}  // namespace scanrig
