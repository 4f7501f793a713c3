#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "pipeline/evaluate/truth_file.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"

namespace scanrig {

/// Limits of what can be seen at all: pipeline.md, section 9.
struct ObservableRule {
  double max_incidence_deg = 70.0;  ///< incidence to left, right and projector
  int margin_px = 8;                ///< inside both images
  double depth_jump_mm = 1.5;       ///< between neighbouring pixels
  int jump_distance_px = 6;
  double min_height_mm = 0.5;  ///< above the table
};

/// What one camera sees of the true object and the table.
struct TrueImage {
  Camera camera;  ///< set up around the object: its camera_from_turntable is camera_from_truth
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< truth frame
  cv::Mat1f depth;                                   ///< z of the object or the table, mm; infinite where neither is
  cv::Mat1i face;                                    ///< of the object; -1 where it is not seen
  cv::Mat1b near_jump;                               ///< 255 within the rule's distance of a depth jump
};

/// One view of the true object, with its own ray casting. Points are in the truth's frame.
class TrueView {
 public:
  /// `truth` and `surface` (of truth.mesh) must outlive the view.
  TrueView(const Truth& truth, const SurfaceIndex& surface, const TruePose& pose, double angle_deg,
           const ObservableRule& rule);

  [[nodiscard]] bool observes(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  [[nodiscard]] const TrueImage& left() const { return left_; }
  [[nodiscard]] const TrueImage& right() const { return right_; }
  [[nodiscard]] const Truth& truth() const { return truth_; }
  [[nodiscard]] const Transform& table_from_truth() const { return table_from_truth_; }

 private:
  [[nodiscard]] TrueImage look(Camera camera) const;
  [[nodiscard]] bool table_blocks(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  const Truth& truth_;
  const SurfaceIndex& surface_;
  ObservableRule rule_;
  Transform table_from_truth_;  ///< the table has turned
  TrueImage left_, right_;
  Eigen::Vector3d projector_;
};

/// The point of the image plane z = 1 that a distorted pixel shows.
Eigen::Vector2d undistort(const Camera& camera, const Eigen::Vector2d& pixel);

}  // namespace scanrig
