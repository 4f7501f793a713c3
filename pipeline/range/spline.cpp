#include "pipeline/range/spline.h"

#include <algorithm>

#include "core/parallel.h"

namespace scanrig {
namespace {

// Pole of the recursive filter of the cubic B-spline, sqrt(3) - 2, and its memory length (1e-9).
constexpr float kPole = -0.26794919f;
constexpr int kMemory = 16;

/// First value of the causal filter for a mirrored signal.
template <class At>
float causal_start(int size, const At& at) {
  float sum = at(0), power = kPole;
  for (int k = 1; k < std::min(size, kMemory); ++k, power *= kPole) sum += power * at(k);
  return sum;
}

void filter_row(float* c, int size) {
  if (size < 2) return;
  c[0] = causal_start(size, [&](int k) { return c[k]; });
  for (int x = 1; x < size; ++x) c[x] += kPole * c[x - 1];
  c[size - 1] = kPole / (kPole * kPole - 1.0f) * (c[size - 1] + kPole * c[size - 2]);
  for (int x = size - 2; x >= 0; --x) c[x] = kPole * (c[x + 1] - c[x]);
  for (int x = 0; x < size; ++x) c[x] *= 6.0f;
}

/// The columns [begin, end) of `image`, all at once, so that the inner loops run along rows.
void filter_columns(cv::Mat1f& image, int begin, int end) {
  const int rows = image.rows;
  if (rows < 2) return;
  for (int x = begin; x < end; ++x) image(0, x) = causal_start(rows, [&](int k) { return image(k, x); });
  for (int y = 1; y < rows; ++y) {
    float* c = image[y];
    const float* above = image[y - 1];
    for (int x = begin; x < end; ++x) c[x] += kPole * above[x];
  }
  for (int x = begin; x < end; ++x) {
    image(rows - 1, x) = kPole / (kPole * kPole - 1.0f) * (image(rows - 1, x) + kPole * image(rows - 2, x));
  }
  for (int y = rows - 2; y >= 0; --y) {
    float* c = image[y];
    const float* below = image[y + 1];
    for (int x = begin; x < end; ++x) c[x] = kPole * (below[x] - c[x]);
  }
  for (int y = 0; y < rows; ++y) {
    float* c = image[y];
    for (int x = begin; x < end; ++x) c[x] *= 6.0f;
  }
}

}  // namespace

cv::Mat1f spline_coefficients(const cv::Mat1f& image) {
  cv::Mat1f c = image.clone();
  parallel_for(static_cast<std::size_t>(c.rows), [&](std::size_t y) { filter_row(c[static_cast<int>(y)], c.cols); });
  constexpr int kBlock = 64;
  const int blocks = (c.cols + kBlock - 1) / kBlock;
  parallel_for(static_cast<std::size_t>(blocks), [&](std::size_t block) {
    const int begin = static_cast<int>(block) * kBlock;
    filter_columns(c, begin, std::min(begin + kBlock, c.cols));
  });
  return c;
}

CubicRows::CubicRows(const cv::Mat1f& image)
    : width_(image.cols), cubics_(static_cast<std::size_t>(image.rows) * static_cast<std::size_t>(image.cols) * 4) {
  parallel_for(static_cast<std::size_t>(image.rows), [&](std::size_t y) {
    std::vector<float> line(image[static_cast<int>(y)], image[static_cast<int>(y)] + width_);
    filter_row(line.data(), width_);
    float* cubic = cubics_.data() + y * static_cast<std::size_t>(width_) * 4;
    const auto at = [&](int x) { return line[static_cast<std::size_t>(std::clamp(x, 0, width_ - 1))]; };
    for (int x = 0; x < width_; ++x, cubic += 4) {
      const float a = at(x - 1), b = at(x), c = at(x + 1), d = at(x + 2);
      cubic[0] = (a + 4.0f * b + c) / 6.0f;
      cubic[1] = (c - a) / 2.0f;
      cubic[2] = (a - 2.0f * b + c) / 2.0f;
      cubic[3] = (d - 3.0f * c + 3.0f * b - a) / 6.0f;
    }
  });
}

}  // namespace scanrig
