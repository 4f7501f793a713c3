#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "pipeline/volume/posed_outline.h"
#include "pipeline/volume/silhouette_votes.h"

namespace scanrig {

/// Rays of a silhouette that meet nothing of what the others leave.
class Surplus {
 public:
  Surplus(const std::vector<PosedOutline>& outlines, const Eigen::AlignedBox3f& box,
          const SilhouetteVoteOptions& options)
      : outlines_(outlines), box_(box), options_(options) {}

  [[nodiscard]] std::optional<SilhouetteFinding> of(std::size_t s, const View& view) const;

 private:
  /// Whether every place along the ray is outside at least `min_silhouettes` others.
  [[nodiscard]] bool is_empty(std::size_t s, cv::Point pixel) const;
  /// Of at least `min_silhouettes` others, or of the box.
  [[nodiscard]] bool is_outside(std::size_t s, const Eigen::Vector3f& point) const;

  const std::vector<PosedOutline>& outlines_;
  Eigen::AlignedBox3f box_;
  SilhouetteVoteOptions options_;
};

}  // namespace scanrig
