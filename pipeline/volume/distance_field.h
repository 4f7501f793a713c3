#pragma once

#include <cstdint>
#include <span>
#include <vector>

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

/// The signed distance of the whole object at any point of the model's frame, gathered from all views.
class Field {
 public:
  /// `views_of_pose`: prepared views, pose after pose.
  Field(std::vector<std::vector<RangeSampler>> views_of_pose, const std::vector<Transform>& model_from_pose, Hull hull,
        const VolumeOptions& options, double band_mm);

  /// The views and bounds that matter near one place.
  struct Neighbourhood {
    std::vector<const RangeSampler*> views;
    Hull hull;
  };
  [[nodiscard]] Neighbourhood near(const Eigen::Vector3f& centre, float radius) const;
  [[nodiscard]] Neighbourhood everywhere() const;

  [[nodiscard]] FieldValue at(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const;
  /// Whether at() is negative; faster outside.
  [[nodiscard]] bool is_inside(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const;
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
  [[nodiscard]] float bounds(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood,
                             std::size_t views_behind) const;

  std::vector<std::vector<RangeSampler>> views_of_pose_;
  std::vector<Transform> pose_from_model_;
  Hull hull_;
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
