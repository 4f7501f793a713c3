#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace scanrig::testing {

/// A camera that shares no code with the product: OpenCV's distortion, inverted by iteration.
struct TestCamera {
  int width = 1280;
  int height = 960;
  double f = 4267.0;
  double cx = 637.2;
  double cy = 481.1;
  double distortion[5] = {-0.080, 0.15, 1.2e-4, -0.9e-4, 0.0};

  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& in_camera) const;
  /// Direction (x, y, 1) seen at a pixel.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& pixel) const;
};

/// A print in a plane: brightness of a point, mm; and the size of what is certainly of one brightness around it.
struct Print {
  std::function<double(const Eigen::Vector2d&)> albedo;
  std::function<double(const Eigen::Vector2d&)> distance_to_edge;  ///< a lower bound, mm
};

struct Exposure {
  std::string pixel_format = "BayerRG8";
  double gains[3] = {0.72, 1.0, 0.83};  ///< of red, green, blue
  double white = 210.0;                 ///< grey levels of albedo 1 in green
  double lens_sigma_px = 0.6;
  double read_noise = 0.8;
  double shot_noise_variance = 0.0263;
  std::uint64_t seed = 1;
  double light_slope = 0.0;  ///< change of the light across the image, share
};

/// Colour of one channel, from 0 to 1, of a print that is not grey.
using ChannelAlbedo = std::function<double(double albedo, int channel)>;

/// Each pixel's ray is intersected with the plane z = 0 of `camera_from_print`; pixels near an edge are made of 9
/// cells of 16 jittered samples. The lens blurs the cells. Then pixels, mosaic, noise, 8 bits.
cv::Mat render(const Print& print, const TestCamera& camera, const Eigen::Isometry3d& camera_from_print,
               const Exposure& exposure, const ChannelAlbedo& channel_albedo = {});

/// Sigma of an edge in such an image: the lens's and the pixel's own.
double edge_sigma(const Exposure& exposure);

/// A ChArUco board, or a plain one with `marker_mm` 0. Upper left square black, or white.
struct PrintedBoard {
  int columns = 12;
  int rows = 9;
  double square_mm = 10.0;
  double marker_mm = 6.0;
  bool starts_white = false;
  std::string dictionary = "4x4_100";
  double border_mm = 10.0;  ///< white panel around it; beyond is grey
};
Print make_print(const PrintedBoard& board);

/// Nominal place of an inner corner, mm, as the product's Board::corner() defines it.
Eigen::Vector3d corner_place(const PrintedBoard& board, int id);

/// The rig's camera, 22 deg above the table and 640 mm away, and a board in it. Turntable frame: Y up, Z to the camera.
struct BoardPlace {
  double tilt_deg = 60.0;    ///< from lying flat, its print towards the camera
  double azimuth_deg = 0.0;  ///< about the table's axis
  double turn_deg = 0.0;     ///< in its own plane: 90 is portrait
  Eigen::Vector3d centre{0.0, 40.0, 0.0};
};
Eigen::Isometry3d camera_from_table();
Eigen::Isometry3d camera_from_board(const BoardPlace& place);

}  // namespace scanrig::testing
