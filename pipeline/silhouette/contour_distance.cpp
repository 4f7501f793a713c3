#include "pipeline/silhouette/contour_distance.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace scanrig {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kBand = 3;  // px on each side of the line where distances are exact

/// Squared distance of every pixel near the line and the nearest point on it.
struct Band {
  cv::Mat1f square;
  cv::Mat2f foot;

  explicit Band(cv::Size size) : square(size, kFar), foot(size, cv::Vec2f(0, 0)) {}

  void add(const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
    const int left = static_cast<int>(std::floor(std::min(a.x(), b.x()))) - kBand;
    const int top = static_cast<int>(std::floor(std::min(a.y(), b.y()))) - kBand;
    const Eigen::Vector2f along = b - a;
    const float length2 = std::max(along.squaredNorm(), 1e-12f);
    for (int y = std::max(top, 0); y <= std::min(top + 2 * kBand + 1, square.rows - 1); ++y) {
      for (int x = std::max(left, 0); x <= std::min(left + 2 * kBand + 1, square.cols - 1); ++x) {
        const Eigen::Vector2f p(static_cast<float>(x), static_cast<float>(y));
        const Eigen::Vector2f nearest = a + along * std::clamp((p - a).dot(along) / length2, 0.0f, 1.0f);
        const float d2 = (p - nearest).squaredNorm();
        if (d2 >= square(y, x)) continue;
        square(y, x) = d2;
        foot(y, x) = {nearest.x(), nearest.y()};
      }
    }
  }
};

/// The line's pieces in the cell between four pixels (marching squares).
void add_cell(const cv::Mat1f& field, int x, int y, Band& band) {
  const std::array<Eigen::Vector2i, 4> corner = {Eigen::Vector2i(x, y), Eigen::Vector2i(x + 1, y),
                                                 Eigen::Vector2i(x + 1, y + 1), Eigen::Vector2i(x, y + 1)};
  std::array<Eigen::Vector2f, 4> crossing;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2i &p = corner[i], &q = corner[(i + 1) % 4];
    const float a = field(p.y(), p.x()), b = field(q.y(), q.x());
    if ((a > 0) == (b > 0)) continue;
    crossing[count++] = p.cast<float>() + (q - p).cast<float>() * (a / (a - b));
  }
  // Four crossings: a saddle; either pairing is as good.
  for (std::size_t i = 0; i + 1 < count; i += 2) band.add(crossing[i], crossing[i + 1]);
}

}  // namespace

cv::Mat1f contour_distance(const cv::Mat1f& field) {
  Band band(field.size());
  for (int y = 0; y + 1 < field.rows; ++y) {
    const float *upper = field[y], *lower = field[y + 1];
    for (int x = 0; x + 1 < field.cols; ++x) {
      const int positive = (upper[x] > 0) + (upper[x + 1] > 0) + (lower[x] > 0) + (lower[x + 1] > 0);
      if (positive != 0 && positive != 4) add_cell(field, x, y, band);
    }
  }
  // Beyond the band: the foot point of the nearest pixel beside the line.
  cv::Mat1b away(field.size());
  std::vector<cv::Vec2f> feet(1);
  cv::compare(band.square, 1.0, away, cv::CMP_GT);
  cv::Mat1f distance;
  cv::Mat1i labels;
  cv::distanceTransform(away, distance, labels, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  for (int y = 0; y < field.rows; ++y) {
    for (int x = 0; x < field.cols; ++x) {
      if (away(y, x) != 0) continue;
      const auto label = static_cast<std::size_t>(labels(y, x));
      if (label >= feet.size()) feet.resize(label + 1);
      feet[label] = band.foot(y, x);
    }
  }
  for (int y = 0; y < field.rows; ++y) {
    const float *square = band.square[y], *outside = field[y];
    const int* label = labels[y];
    float* out = distance[y];
    for (int x = 0; x < field.cols; ++x) {
      float square_here = square[x];
      if (square_here > static_cast<float>(kBand * kBand) && feet.size() > 1) {
        const cv::Vec2f foot = feet[static_cast<std::size_t>(label[x])];
        const float right = foot[0] - static_cast<float>(x), down = foot[1] - static_cast<float>(y);
        square_here = std::min(square_here, right * right + down * down);
      }
      out[x] = std::copysign(std::sqrt(square_here), outside[x] > 0 ? 1.0f : -1.0f);
    }
  }
  return distance;
}

cv::Mat1f distance_beyond(const cv::Mat1f& outside_px, const cv::Rect& box) {
  cv::Mat1f larger(box.size());
  const int last_u = outside_px.cols - 1, last_v = outside_px.rows - 1;
  const int begin = std::clamp(-box.x, 0, larger.cols), end = std::clamp(outside_px.cols - box.x, begin, larger.cols);
  for (int y = 0; y < larger.rows; ++y) {
    const int v = y + box.y, inner_v = std::clamp(v, 0, last_v);
    const float down = std::abs(static_cast<float>(v - inner_v));
    const float* inner = outside_px[inner_v];
    float* out = larger[y];
    const auto beside = [&](int x, int inner_u) {
      const float right = static_cast<float>(x + box.x - inner_u);
      out[x] = inner[inner_u] + std::sqrt(right * right + down * down);
    };
    for (int x = 0; x < begin; ++x) beside(x, 0);
    for (int x = begin; x < end; ++x) out[x] = inner[x + box.x] + down;
    for (int x = end; x < larger.cols; ++x) beside(x, last_u);
  }
  return larger;
}

}  // namespace scanrig
