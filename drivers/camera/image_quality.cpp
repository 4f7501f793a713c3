#include "drivers/camera/image_quality.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace scanrig {
namespace {

/// One grey value per `step` pixels of a row and column, `channels` bytes apart, beginning at column `first`.
struct Plane {
  const cv::Mat& image;
  int first;     // byte within the row
  int step;      // pixels between samples, both ways
  int channels;  // bytes per pixel

  [[nodiscard]] int rows() const { return image.rows / step; }
  [[nodiscard]] int cols() const { return image.cols / step; }
  [[nodiscard]] const std::uint8_t* row(int y) const { return image.ptr<std::uint8_t>(y * step) + first; }
  [[nodiscard]] int pitch() const { return step * channels; }
};

Plane plane_of(const cv::Mat& image, PixelFormat format) {
  switch (format) {
    case PixelFormat::bayer_rggb8: return {image, 1, 2, 1};
    case PixelFormat::bgr8: return {image, 1, 1, 3};
    case PixelFormat::mono8: break;
  }
  return {image, 0, 1, 1};
}

/// Laplacian at sample x of three neighbouring rows.
int bend_at(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int i, int pitch) {
  return here[i + pitch] + here[i - pitch] + below[i] + above[i] - 4 * here[i];
}

/// Enough for statistics; the next exposure waits for them. Rows of a mosaic are rows of one colour.
constexpr int kEveryRow = 4;

/// For independent grains seen through a Gaussian blur of standard deviation s, the spectrum falls as exp(-s^2 w^2),
/// and the mean squares of gradient and Laplacian are as s^2 to 2.
double blur_px(const Plane& plane) {
  double gradient = 0.0, laplacian = 0.0;
  for (int y = 1; y + 1 < plane.rows(); y += kEveryRow) {
    const std::uint8_t *above = plane.row(y - 1), *here = plane.row(y), *below = plane.row(y + 1);
    std::int64_t row_gradient = 0, row_laplacian = 0;
    for (int x = 1; x + 1 < plane.cols(); ++x) {
      const int i = x * plane.pitch(), left = i - plane.pitch(), right = i + plane.pitch();
      const int across = here[right] - here[left], down = below[i] - above[i];
      const int bend = bend_at(above, here, below, i, plane.pitch());
      row_gradient += across * across + down * down;
      row_laplacian += bend * bend;
    }
    gradient += static_cast<double>(row_gradient) / 4.0;
    laplacian += static_cast<double>(row_laplacian);
  }
  if (laplacian <= 0.0) return std::numeric_limits<double>::quiet_NaN();
  return plane.step * std::sqrt(2.0 * gradient / laplacian);
}

}  // namespace

ImageQuality measure(const cv::Mat& image, PixelFormat format) {
  if (image.empty()) return {};
  const auto count = static_cast<double>(image.total() * image.elemSize());
  std::int64_t sum = 0, full = 0;
  for (int y = 0; y < image.rows; ++y) {
    const std::span row(image.ptr<std::uint8_t>(y), static_cast<std::size_t>(image.cols) * image.elemSize());
    std::uint32_t row_sum = 0, row_full = 0;
    for (const std::uint8_t grey : row) {
      row_sum += grey;
      row_full += grey == 255;
    }
    sum += row_sum;
    full += row_full;
  }
  return {static_cast<double>(sum) / (255.0 * count), static_cast<double>(full) / count,
          blur_px(plane_of(image, format))};
}

double texture(const cv::Mat& image, PixelFormat format) {
  if (image.empty()) return 0.0;
  const Plane plane = plane_of(image, format);
  double sum = 0.0, count = 0.0;
  for (int y = 1; y + 1 < plane.rows(); y += kEveryRow) {
    std::int64_t row_sum = 0;
    for (int x = 1; x + 1 < plane.cols(); ++x) {
      const std::int64_t bend =
          bend_at(plane.row(y - 1), plane.row(y), plane.row(y + 1), x * plane.pitch(), plane.pitch());
      row_sum += bend * bend;
    }
    sum += static_cast<double>(row_sum);
    count += plane.cols() - 2;
  }
  constexpr double kOfIndependentPixels = 20.0;  // variance of 4 a - b - c - d - e
  return count > 0.0 ? std::sqrt(sum / count / kOfIndependentPixels) / 255.0 : 0.0;
}

double left_right_correlation(const cv::Mat& left, const cv::Mat& right, PixelFormat format) {
  if (left.empty() || left.size() != right.size() || left.type() != right.type()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Plane a = plane_of(left, format), b = plane_of(right, format);
  // Row by row: a mark in one corner, or an edge along a row, is no evidence that the images are alike.
  std::vector<double> rows;
  for (int y = 1; y + 1 < a.rows(); y += kEveryRow) {
    std::int64_t both = 0, only_a = 0, only_b = 0;
    for (int x = 1; x + 1 < a.cols(); ++x) {
      const int i = x * a.pitch();
      const int bend_a = bend_at(a.row(y - 1), a.row(y), a.row(y + 1), i, a.pitch());
      const int bend_b = bend_at(b.row(y - 1), b.row(y), b.row(y + 1), i, b.pitch());
      both += bend_a * bend_b;
      only_a += bend_a * bend_a;
      only_b += bend_b * bend_b;
    }
    if (only_a > 0 && only_b > 0) {
      rows.push_back(static_cast<double>(both) / std::sqrt(static_cast<double>(only_a) * static_cast<double>(only_b)));
    }
  }
  if (rows.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto upper = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() * 3 / 4);
  std::ranges::nth_element(rows, upper);
  return *upper;
}

}  // namespace scanrig
