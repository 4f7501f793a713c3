#include "tests/unit/pipeline/calibration/board_renderer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "pipeline/calibration/board/markers.h"

namespace scanrig::testing {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

constexpr int kFine = 3;  // cells per pixel and axis: the lens blurs these, then the pixel takes their mean

cv::Mat1d gaussian(double sigma_px) {
  const double sigma = sigma_px * kFine;
  return cv::getGaussianKernel(2 * static_cast<int>(std::ceil(4.0 * sigma)) + 1, sigma, CV_64F);
}

/// Small and fast, for jitter only.
struct Jitter {
  std::uint64_t state;
  double operator()() {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) * 0x1.0p-53;
  }
};

/// Albedo before the lens, in cells.
cv::Mat1f cast_rays(const Print& print, const TestCamera& camera, const Eigen::Isometry3d& camera_from_print,
                    std::uint64_t seed) {
  Jitter jitter{seed};
  const Eigen::Isometry3d print_from_camera = camera_from_print.inverse();
  const Eigen::Vector3d eye = print_from_camera.translation();
  const auto hit = [&](const Eigen::Vector2d& pixel) -> Eigen::Vector2d {
    const Eigen::Vector3d direction = print_from_camera.linear() * camera.ray(pixel);
    return (eye - eye.z() / direction.z() * direction).head<2>();
  };
  cv::Mat1f cells(camera.height * kFine, camera.width * kFine);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d centre(x, y);
      const Eigen::Vector2d middle = hit(centre);
      const Eigen::Vector2d right = hit(centre + Eigen::Vector2d(0.5, 0.0)) - middle;
      const Eigen::Vector2d down = hit(centre + Eigen::Vector2d(0.0, 0.5)) - middle;
      if (print.distance_to_edge(middle) > right.norm() + down.norm()) {
        cells(cv::Rect(x * kFine, y * kFine, kFine, kFine)) = static_cast<float>(print.albedo(middle));
        continue;
      }
      constexpr int kSide = 4;  // samples per cell and axis
      for (int cell = 0; cell < kFine * kFine; ++cell) {
        double sum = 0.0;
        for (int i = 0; i < kSide * kSide; ++i) {
          const int column = cell % kFine * kSide + i % kSide;  // of kFine * kSide in a pixel
          const int row = cell / kFine * kSide + i / kSide;
          const double u = (column + jitter()) / (kSide * kFine) * 2.0 - 1.0;
          const double v = (row + jitter()) / (kSide * kFine) * 2.0 - 1.0;
          sum += print.albedo(middle + u * right + v * down);
        }
        cells(y * kFine + cell / kFine, x * kFine + cell % kFine) = static_cast<float>(sum / (kSide * kSide));
      }
    }
  }
  return cells;
}

}  // namespace

Eigen::Vector2d TestCamera::project(const Eigen::Vector3d& p) const {
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + distortion[0] * r2 + distortion[1] * r2 * r2 + distortion[4] * r2 * r2 * r2;
  const double u = x * radial + 2.0 * distortion[2] * x * y + distortion[3] * (r2 + 2.0 * x * x);
  const double v = y * radial + 2.0 * distortion[3] * x * y + distortion[2] * (r2 + 2.0 * y * y);
  return {f * u + cx, f * v + cy};
}

Eigen::Vector3d TestCamera::ray(const Eigen::Vector2d& pixel) const {
  Eigen::Vector3d direction((pixel.x() - cx) / f, (pixel.y() - cy) / f, 1.0);
  for (int i = 0; i < 4; ++i) direction.head<2>() += (pixel - project(direction)) / f;
  return direction;
}

cv::Mat render(const Print& print, const TestCamera& camera, const Eigen::Isometry3d& camera_from_print,
               const Exposure& exposure, const ChannelAlbedo& channel_albedo) {
  const cv::Mat1f light = cast_rays(print, camera, camera_from_print, exposure.seed * 7919 + 13);
  const cv::Mat1d kernel = gaussian(exposure.lens_sigma_px);
  const auto channels = exposure.pixel_format == "Mono8" ? 1 : 3;
  std::vector<cv::Mat1f> blurred(static_cast<std::size_t>(channels));
  for (int c = 0; c < channels; ++c) {
    cv::Mat1f& plane = blurred[static_cast<std::size_t>(c)];
    if (c > 0 && !channel_albedo) {
      plane = blurred[0];
      continue;
    }
    cv::Mat1f cells = light.clone();
    if (channel_albedo) {
      for (float& value : cells) value = static_cast<float>(channel_albedo(value, c));
    }
    cv::sepFilter2D(cells, cells, CV_32F, kernel, kernel, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    cv::resize(cells, plane, {camera.width, camera.height}, 0.0, 0.0, cv::INTER_AREA);
  }
  std::mt19937_64 random(exposure.seed);
  std::normal_distribution<double> normal;
  const auto expose = [&](int x, int y, int channel) {
    const double gain = channels == 1 ? 1.0 : exposure.gains[channel];
    const double slope = 1.0 + exposure.light_slope * (static_cast<double>(x) / camera.width - 0.5);
    const double level = blurred[static_cast<std::size_t>(channel)](y, x) * gain * exposure.white * slope;
    const double noise = std::sqrt(exposure.read_noise * exposure.read_noise + exposure.shot_noise_variance * level);
    return cv::saturate_cast<uchar>(level + noise * normal(random));
  };
  cv::Mat image(camera.height, camera.width, exposure.pixel_format == "BGR8" ? CV_8UC3 : CV_8UC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (exposure.pixel_format == "BGR8") {
        for (int c = 0; c < 3; ++c) image.at<cv::Vec3b>(y, x)[2 - c] = expose(x, y, c);
      } else {
        image.at<uchar>(y, x) = expose(x, y, channels == 1 ? 0 : x % 2 + y % 2);
      }
    }
  }
  return image;
}

double edge_sigma(const Exposure& exposure) { return std::hypot(exposure.lens_sigma_px, std::sqrt(1.0 / 12.0)); }

Print make_print(const PrintedBoard& board) {
  std::vector<cv::Mat1b> markers;
  if (board.marker_mm > 0.0) {
    for (int id = 0; id < board.columns * board.rows / 2 + 1; ++id) {
      markers.push_back(marker_bits(board.dictionary, id).value());
    }
  }
  const double cell = markers.empty() ? 1.0 : board.marker_mm / markers[0].cols;
  const Eigen::Vector2d half(0.5 * board.columns * board.square_mm, 0.5 * board.rows * board.square_mm);
  const double gap = 0.5 * (board.square_mm - board.marker_mm);
  std::vector<int> id_of(static_cast<std::size_t>(board.columns * board.rows), -1);  // OpenCV: white squares, by row
  int next = 0;
  for (int i = 0; i < board.columns * board.rows; ++i) {
    const bool is_white = ((i % board.columns + i / board.columns) % 2 != 0) != board.starts_white;
    if (is_white) id_of[static_cast<std::size_t>(i)] = next++;
  }
  Print print;
  print.albedo = [=](const Eigen::Vector2d& p) {
    const Eigen::Vector2d q = p + half;
    const Eigen::Vector2d beyond = p.cwiseAbs() - half;
    if (beyond.maxCoeff() > board.border_mm) return 0.25;
    if (beyond.maxCoeff() >= 0.0) return 0.9;
    const int column = std::min(static_cast<int>(q.x() / board.square_mm), board.columns - 1);
    const int row = std::min(static_cast<int>(q.y() / board.square_mm), board.rows - 1);
    const int id = id_of.at(static_cast<std::size_t>(row) * static_cast<std::size_t>(board.columns) +
                            static_cast<std::size_t>(column));
    if (id < 0) return 0.05;
    if (markers.empty()) return 0.9;
    const double x = q.x() - column * board.square_mm - gap;
    const double y = q.y() - row * board.square_mm - gap;
    if (x < 0.0 || y < 0.0 || x >= board.marker_mm || y >= board.marker_mm) return 0.9;
    const auto& bits = markers[static_cast<std::size_t>(id)];
    return bits(std::min(static_cast<int>(y / cell), bits.rows - 1),
                std::min(static_cast<int>(x / cell), bits.cols - 1)) != 0
               ? 0.9
               : 0.05;
  };
  print.distance_to_edge = [=](const Eigen::Vector2d& p) {
    const Eigen::Vector2d q = p + half;
    const double beyond = (p.cwiseAbs() - half).maxCoeff();
    if (beyond > 0.0) return std::min(beyond, std::abs(beyond - board.border_mm));
    const auto nearest = [](double value, double step) { return std::abs(value - step * std::round(value / step)); };
    double distance = std::min(nearest(q.x(), board.square_mm), nearest(q.y(), board.square_mm));
    if (markers.empty()) return distance;
    for (int axis = 0; axis < 2; ++axis) {
      const double inside = q[axis] - board.square_mm * std::floor(q[axis] / board.square_mm) - gap;
      if (inside > -cell && inside < board.marker_mm + cell) distance = std::min(distance, nearest(inside, cell));
    }
    return distance;
  };
  return print;
}

Eigen::Vector3d corner_place(const PrintedBoard& board, int id) {
  const int in_row = board.columns - 1;
  const int column = id % in_row + 1;
  const int row = id / in_row + 1;
  return {(column - 0.5 * board.columns) * board.square_mm, (row - 0.5 * board.rows) * board.square_mm, 0.0};
}

Eigen::Isometry3d camera_from_table() {
  const double up = 22.0 * kDegree;
  const Eigen::Vector3d aim(0.0, 45.0, 0.0);
  const Eigen::Vector3d eye = aim + 640.0 * Eigen::Vector3d(0.0, std::sin(up), std::cos(up));
  Eigen::Matrix3d axes;  // rows: the camera's axes in the table's frame
  axes.row(2) = (aim - eye).normalized();
  axes.row(0) = axes.row(2).cross(Eigen::RowVector3d::UnitY()).normalized();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = axes;
  pose.translation() = -axes * eye;
  return pose;
}

Eigen::Isometry3d camera_from_board(const BoardPlace& place) {
  // Flat on the table: x right, y towards the camera, z down into the board; then tilted up towards the camera.
  Eigen::Isometry3d table_from_board = Eigen::Isometry3d::Identity();
  Eigen::Matrix3d flat;
  flat << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  table_from_board.linear() = (Eigen::AngleAxisd(place.azimuth_deg * kDegree, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(place.tilt_deg * kDegree, Eigen::Vector3d::UnitX()))
                                  .toRotationMatrix() *
                              flat *
                              Eigen::AngleAxisd(place.turn_deg * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  table_from_board.translation() =
      Eigen::AngleAxisd(place.azimuth_deg * kDegree, Eigen::Vector3d::UnitY()) * place.centre;
  return camera_from_table() * table_from_board;
}

}  // namespace scanrig::testing
