#pragma once

#include <Eigen/Core>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

namespace scanrig::acceptance {

/// Points, for nanoflann.
struct Cloud {
  const std::vector<Eigen::Vector3d>& points;  // NOLINT(cppcoreguidelines-avoid-const-or-ref-data-members): a view
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t k) const {
    return points[i][static_cast<Eigen::Index>(k)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

using PointTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, std::size_t>;

/// For nanoflann: every point nearer than `reach_mm`, as `use(index, squared distance)`.
template <class Use>
class WithinReach {
 public:
  using DistanceType = double;
  using IndexType = std::size_t;

  WithinReach(double reach_mm, Use use) : squared_reach_(reach_mm * reach_mm), use_(std::move(use)) {}

  // Names that nanoflann calls.
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return squared_reach_; }
  void sort() {}
  bool addPoint(double squared, std::size_t index) {
    if (squared >= squared_reach_) return true;
    ++count_;
    use_(index, squared);
    return true;
  }

 private:
  double squared_reach_;
  Use use_;
  std::size_t count_ = 0;
};

}  // namespace scanrig::acceptance
