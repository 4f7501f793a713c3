#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/transform.h"
#include "pipeline/calibration/board_print.h"
#include "pipeline/calibration/lens_field.h"

namespace scanrig {

/// Mapping of points of a camera frame to pixels of a distortion-free image. Axes as in OpenCV: x right, y down, z into
/// the scene; mm. Pixel centres are at integer coordinates. Orthographic grids come from imported range scans.
struct Projection {
  enum class Kind { pinhole, orthographic };
  Kind kind = Kind::pinhole;
  int width = 0;
  int height = 0;
  double fx = 0.0;  ///< pixels (pinhole) or pixels per millimetre (orthographic)
  double fy = 0.0;
  double cx = 0.0;  ///< pixels
  double cy = 0.0;
  /// Of an image cropped to the object: its first pixel on the sensor, and the sensor's size. 0: not cropped.
  int crop_x = 0;
  int crop_y = 0;
  int sensor_width = 0;
  int sensor_height = 0;

  [[nodiscard]] bool is_cropped() const { return sensor_width > 0; }
  /// The part of this image that begins at (x, y); x and y may be negative within the sensor.
  [[nodiscard]] Projection cropped(int x, int y, int part_width, int part_height) const {
    Projection part = *this;
    part.sensor_width = is_cropped() ? sensor_width : width;
    part.sensor_height = is_cropped() ? sensor_height : height;
    part.crop_x += x;
    part.crop_y += y;
    part.cx -= x;
    part.cy -= y;
    part.width = part_width;
    part.height = part_height;
    return part;
  }
  /// On the sensor, but cropped off.
  [[nodiscard]] bool is_cropped_off(const Eigen::Vector2d& pixel, double margin = 0.0) const {
    return is_cropped() && !contains(pixel) && pixel.x() + crop_x >= margin && pixel.y() + crop_y >= margin &&
           pixel.x() + crop_x <= sensor_width - 1 - margin && pixel.y() + crop_y <= sensor_height - 1 - margin;
  }
  /// Pixel (u, v) of a point in the camera frame. A pinhole point must have z > 0.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    const double scale = kind == Kind::pinhole ? 1.0 / p.z() : 1.0;
    return {fx * p.x() * scale + cx, fy * p.y() * scale + cy};
  }
  /// The point at `depth` (z, mm) seen in pixel (u, v).
  [[nodiscard]] Eigen::Vector3d unproject(double u, double v, double depth) const {
    const double scale = kind == Kind::pinhole ? depth : 1.0;
    return {(u - cx) / fx * scale, (v - cy) / fy * scale, depth};
  }
  /// Millimetres on the object that one pixel spans at `depth`.
  [[nodiscard]] double mm_per_pixel(double depth) const { return (kind == Kind::pinhole ? depth : 1.0) / fx; }
  [[nodiscard]] bool contains(const Eigen::Vector2d& pixel, double margin = 0.0) const {
    return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= width - 1 - margin &&
           pixel.y() <= height - 1 - margin;
  }
};

/// A calibrated sensor. Brown-Conrady distortion as in OpenCV: k1, k2, p1, p2, k3; then the lens field, if it has one.
struct Camera {
  Projection projection;  ///< pinhole
  std::array<double, 5> distortion{};
  std::optional<LensField> lens_field;
  Transform camera_from_turntable = Transform::Identity();
  std::string serial;

  /// Pixel, distortion included, of a point in the turntable frame; it must lie in front of the camera.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& point_in_turntable) const;
  /// The inverse: the direction in the camera frame, with z = 1, that `pixel` shows. To 1e-9 px for lenses that bend a
  /// ray by less than a tenth.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& pixel) const;
};

/// How sure a calibration is of itself; docs/reference/calibration.md.
struct CalibrationQuality {
  std::string grade;       ///< A, B or C
  double volume_um = 0.0;  ///< sigma of a point in the working volume: axis, shape and azimuth; without scale
  double scale_um = 0.0;   ///< of all lengths alike, likewise
  /// Covariance of both cameras' unknowns, left first, 15 each: fx, fy / fx, cx, cy, k1 k2 p1 p2 k3, turn (rad) and
  /// shift (mm) of the table in the camera frame.
  Eigen::MatrixXd cameras;
  std::vector<Eigen::Vector3d> rim_dots;  ///< in the turntable frame at table angle 0; empty: none
  double rim_dot_diameter_mm = 0.0;
  double gear = 1.0;                ///< turned angle over reported angle of the table
  std::optional<BoardPrint> board;  ///< of the board it was made with; none: not in its file
};

/// The rig's calibration for the reconstruction. It defines the turntable frame: +Y is the axis, y = 0 the table top.
struct Calibration {
  Camera left;
  Camera right;
  double table_radius_mm = 0.0;
  std::optional<CalibrationQuality> quality;  ///< none: of unknown origin, as in files of version 1
  std::string date;                           ///< ISO 8601
  std::string sha256;                         ///< of the file it was read from
};

/// Whether it belongs to cameras with these serial numbers. One that is empty on either side is not compared.
bool is_of_cameras(const Calibration& calibration, const std::string& left, const std::string& right);

}  // namespace scanrig
