#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "pipeline/calibration/distortion_table.h"
#include "pipeline/texture/depth_map.h"
#include "pipeline/texture/texture.h"

namespace scanrig {

/// A point of the surface in one photo.
struct Sight {
  Eigen::Vector2d pixel;  ///< in the photo, distortion included
  double weight = 0.0;    ///< 0..about 1: cos^2 of the incidence * resolution, fading out towards depth edges
};

struct Sample {
  Eigen::Vector3f bgr = Eigen::Vector3f::Zero();  ///< linear, 1 = full scale
  bool saturated = false;                         ///< one of its pixels is at the sensor's maximum: not a measurement
};

/// A photo together with the mesh surface it shows. Refers to the given photo; threads: const functions from any.
class PhotoView {
 public:
  /// `typical_px_per_mm` is the resolution with weight 1.
  PhotoView(const Photo& photo, const Mesh& mesh, const TextureOptions& options, double typical_px_per_mm);

  /// The place of `point` with unit `normal` (model frame, mm) in the photo; nothing if the photo does not show it.
  [[nodiscard]] std::optional<Sight> look(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  /// Where the photo shows `point` unless something is in front; nothing behind the camera.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& point) const;
  /// The colour there, between pixels (bicubic); `pixel` as returned by look().
  [[nodiscard]] Sample sample(const Eigen::Vector2f& pixel) const;

  /// From now on the photo shows nothing where `mask`, of its size, is not 0, and fades out towards it.
  void leave_out(const cv::Mat1b& mask);

  [[nodiscard]] const Photo& photo() const { return *photo_; }
  [[nodiscard]] Transform camera_from_model() const { return camera_from_model_; }
  [[nodiscard]] const Eigen::Vector3d& centre() const { return centre_; }  ///< of projection, model frame
  /// Unit vector from `point` to the camera, model frame.
  [[nodiscard]] Eigen::Vector3d towards(const Eigen::Vector3d& point) const { return (centre_ - point).normalized(); }

 private:
  void cut_at_border();
  void find_edges();
  void fade_out_towards(const cv::Mat1b& kept);
  void hide_behind(const std::vector<Eigen::Vector3f>& in_front);

  const Photo* photo_;
  DistortionTable distortion_;
  Transform camera_from_model_;
  Eigen::Vector3d centre_;
  double px_per_mm_at_1mm_;  ///< focal length over the typical resolution
  double cos_limit_, edge_px_, edge_fade_px_;
  int saturated_;
  DepthMap seen_;           ///< in pixels of a camera without distortion
  cv::Mat1f edge_px_away_;  ///< of the same window: distance to the nearest depth edge or outline
};

/// Pixels per millimetre in the middle of the mesh, median over the photos.
double typical_px_per_mm(const Mesh& mesh, std::span<const Photo> photos);

}  // namespace scanrig
