#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/parallel_blocks.h"
#include "pipeline/volume/bricks.h"
#include "pipeline/volume/class_table.h"
#include "pipeline/volume/hull.h"
#include "pipeline/volume/integrate.h"
#include "pipeline/volume/range_sampler.h"

namespace scanrig {

/// Origin of the field's value at a point.
enum class Support : std::uint8_t {
  bounds,    ///< unmeasured: the hull decides, or it is unseen
  free,      ///< seen through
  measured,  ///< near a measured surface
};

struct FieldValue {
  float distance = 0.0F;  ///< mm, positive outside, clamped to the band
  Support support = Support::bounds;
};

/// How far views lie from their mean, each in units of what its sigma lets expect.
struct Scatter {
  float sum = 0.0F, count = 0.0F;  ///< of views; their quotient is 1 where sigmas are right

  Scatter& operator+=(const Scatter& other) {
    sum += other.sum;
    count += other.count;
    return *this;
  }
  Scatter operator/(float divisor) const { return {sum / divisor, count / divisor}; }
};

/// Data of the range images for a point of the surface.
struct PointEvidence {
  float surface_distance = 0.0F;  ///< weighted mean of the views' distances, without hull and free space
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  int views = 0;       ///< that measured the surface within a voxel of the point
  float sigma = 0.0F;  ///< of `surface_distance`
  Scatter scatter;
};

/// A view of the field, and where its pixels come from when only some of them are held.
struct FieldView {
  RangeSampler sampler;
  RangeSampler::PartSource part;
};

/// Middle weight over all measured pixels, and their centroid.
struct SurfaceStatistics {
  float median_weight = 1.0F;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// The signed distance of the whole object at any point of the model's frame, gathered from all views. With more than
/// one brick only the pixels that one brick needs are held: before points are evaluated their brick is focused, which
/// no other thread may use meanwhile. The values are the same.
class Field {
 public:
  /// `views_of_pose`: pose after pose; they hold all their pixels. `box` around all points that are evaluated.
  Field(std::vector<std::vector<FieldView>> views_of_pose, const SurfaceStatistics& statistics,
        const std::vector<Transform>& model_from_pose, Hull hull, const Eigen::AlignedBox3f& box,
        const VolumeOptions& options, double band_mm);

  [[nodiscard]] const Bricks& bricks() const { return bricks_; }
  /// From now on no pixels are held but those of a brick in focus: as few bricks as keep them within `bytes`, at most
  /// so many along an axis.
  void divide(std::uintmax_t bytes, int max_per_axis);
  /// Prepares for points within `kBrickRoom` voxels of a brick.
  void focus(std::size_t brick);
  /// Lets the pixels go until the next focus(), where there is one.
  void release();
  /// `body(i)` for the numbers [0, count), in parallel, brick after brick; `point_of(i)`: where i belongs.
  template <class PointOf, class Body>
  void for_each_in_bricks(std::size_t count, const PointOf& point_of, const Body& body) {
    if (bricks_.count() == 1) return for_each_in_blocks(count, body);
    const auto of_brick = bricks_.sorted(count, point_of);
    for (std::size_t brick = 0; brick < of_brick.size(); ++brick) {
      if (of_brick[brick].empty()) continue;
      focus(brick);
      for_each_in_blocks(of_brick[brick].size(), [&](std::size_t i) { body(of_brick[brick][i]); });
    }
  }
  static constexpr float kBrickRoom = 12.0F;  ///< a block from its first node, and how far a vertex is moved

  /// The views and bounds that matter near one place.
  struct Neighbourhood {
    std::vector<const RangeSampler*> views;
    Hull hull;
  };
  [[nodiscard]] Neighbourhood near(const Eigen::Vector3f& centre, float radius) const;
  [[nodiscard]] Neighbourhood everywhere() const;

  [[nodiscard]] FieldValue at(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const;
  /// False where at() is positive whatever the views measured; needs no brick in focus.
  [[nodiscard]] bool may_be_inside(const Eigen::Vector3f& point) const {
    return !hull_.is_beyond(point, hull_tolerance_);
  }
  [[nodiscard]] PointEvidence evidence_at(const Eigen::Vector3f& point) const;
  [[nodiscard]] PoseDistance pose_distance(const Eigen::Vector3f& point, std::size_t pose) const;
  [[nodiscard]] std::size_t poses() const { return views_of_pose_.size(); }
  [[nodiscard]] float class_threshold() const { return class_threshold_; }
  [[nodiscard]] float band() const { return band_; }
  /// Half width, on the surface, of what one measurement saw: median of the views, mm.
  [[nodiscard]] float window_mm() const;

 private:
  [[nodiscard]] FieldValue from_evidence(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const;
  [[nodiscard]] FieldValue from_class_table(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const;
  [[nodiscard]] Eigen::AlignedBox3f box_of(const Bricks& bricks, std::size_t brick) const;
  [[nodiscard]] std::uintmax_t bytes_in(const Bricks& bricks) const;
  [[nodiscard]] float bounds(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood,
                             std::size_t views_behind) const;

  std::vector<std::vector<FieldView>> views_of_pose_;
  std::vector<Transform> pose_from_model_;
  Hull hull_;
  Bricks bricks_;
  std::optional<std::size_t> focused_;
  float room_mm_;
  VolumeOptions::Fusion fusion_;
  std::size_t images_per_outside_;
  float view_sigmas_;
  float band_;              ///< mm
  float class_threshold_;   ///< d_TH of the paper, mm
  float hull_tolerance_;    ///< a measured surface may extend beyond the hull by this, mm
  float free_weight_;       ///< of one view that sees through, against the weights of measured surfaces
  Eigen::Vector3d centre_;  ///< of what was measured; outward directions start at the vertical line through it
};

}  // namespace scanrig
