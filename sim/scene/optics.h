#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "core/transform.h"

namespace scanrig::sim {

/// What a lens does beyond Brown's model: a smooth field of displacements, pixels of the eye's own image.
struct LensResidual {
  static constexpr int kTerms = 4;  ///< along each axis

  /// At (x, y) = ((u + 0.5) / width, (v + 0.5) / height) the pixel (u, v) of Brown's model is displaced by the sum of
  /// du(i, j) cos(i pi x) cos(j pi y), and dv likewise.
  Eigen::Matrix4d du = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d dv = Eigen::Matrix4d::Zero();

  [[nodiscard]] Eigen::Vector2d at(double x, double y) const;
};

/// A lens and a raster: camera, or projector run backwards. Axes as in OpenCV: x right, y down, z forward; mm; pixel
/// centres at integer coordinates; distortion k1 k2 p1 p2 k3 as in OpenCV.
struct Eye {
  std::string serial;
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  std::array<double, 5> distortion{};
  Transform eye_from_turntable = Transform::Identity();
  std::optional<LensResidual> residual = std::nullopt;  ///< nothing: exactly Brown's model
  double focus_off_mm = 0.0;                            ///< of the plane in focus, behind the aim point

  /// Pixel of a point in the turntable frame in front of the eye.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& point_in_turntable) const;
  /// Direction in the eye's frame, z = 1, of a (distorted) pixel.
  [[nodiscard]] Eigen::Vector3d ray(double u, double v) const;
  /// Position of the eye in the turntable frame.
  [[nodiscard]] Eigen::Vector3d centre() const { return eye_from_turntable.inverse().translation(); }
};

struct RigGeometry {
  Eye left;
  Eye right;
  Eye projector;
};

/// An eye at `centre` that looks at `target` with its x axis horizontal: eye_from_turntable.
Transform looking_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target);

/// Smallest and largest resolution of the simulated sensors, as shares of 1280x960: 128x96 and 4096x3072.
inline constexpr double kSmallestImageScale = 0.1, kLargestImageScale = 3.2;

/// The default rig with sensors of `image_scale` times the full resolution and the same field of view.
RigGeometry default_rig(double image_scale = 1.0);

}  // namespace scanrig::sim
