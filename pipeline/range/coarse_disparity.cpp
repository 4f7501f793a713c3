#include "pipeline/range/coarse_disparity.h"

#include <algorithm>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/range/range_image.h"

namespace scanrig {
namespace {

/// Local contrast normalised to one level, 8 bit: shading and albedo are removed, the pattern stays.
cv::Mat1b flattened(const cv::Mat1f& image) {
  const cv::Size window(25, 25);
  cv::Mat1f mean, square, deviation;
  cv::boxFilter(image, mean, CV_32F, window, cv::Point(-1, -1), true, cv::BORDER_REPLICATE);
  cv::boxFilter(image.mul(image), square, CV_32F, window, cv::Point(-1, -1), true, cv::BORDER_REPLICATE);
  cv::sqrt(cv::max(square - mean.mul(mean), 0.0f), deviation);
  // Two grey levels of noise stay noise.
  const cv::Mat flat = 128.0f + 45.0f * (image - mean) / (deviation + 2.0f);
  cv::Mat1b out;
  flat.convertTo(out, CV_8U);
  return out;
}

cv::Mat1b widened(const cv::Mat1b& image, int margin) {
  cv::Mat1b out;
  cv::copyMakeBorder(image, out, 0, 0, margin, margin, cv::BORDER_REPLICATE);
  return out;
}

cv::Mat1f match(const cv::Mat1b& here, const cv::Mat1b& there, int min_disparity, int count) {
  constexpr int kBlock = 5;
  const auto matcher = cv::StereoSGBM::create(min_disparity, count, kBlock, 4 * kBlock * kBlock, 24 * kBlock * kBlock,
                                              -1, 31, 3, 60, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat1s fixed;
  matcher->compute(here, there, fixed);
  cv::Mat1f disparity(fixed.size());
  const short unknown = static_cast<short>((min_disparity - 1) * 16);
  for (int y = 0; y < fixed.rows; ++y) {
    for (int x = 0; x < fixed.cols; ++x) {
      disparity(y, x) = fixed(y, x) <= unknown ? kUnmeasured : static_cast<float>(fixed(y, x)) / 16.0f;
    }
  }
  return disparity;
}

cv::Mat1f flipped(const cv::Mat1f& image) {
  cv::Mat1f out;
  cv::flip(image, out, 1);
  return out;
}

}  // namespace

CoarseDisparity coarse_disparity(const cv::Mat1f& left, const cv::Mat1f& right, int min_disparity, int max_disparity,
                                 cv::Range rows) {
  const int count = std::max(16, (max_disparity - min_disparity + 16) / 16 * 16);
  // OpenCV leaves out the columns whose search would leave the image.
  const int margin = std::max({std::abs(min_disparity), std::abs(min_disparity + count), 16});
  const cv::Mat1b a = widened(flattened(left.rowRange(rows)), margin);
  const cv::Mat1b b = widened(flattened(right.rowRange(rows)), margin);
  cv::Mat1b a_mirrored, b_mirrored;
  cv::flip(a, a_mirrored, 1);
  cv::flip(b, b_mirrored, 1);
  const cv::Range columns(margin, margin + left.cols);
  CoarseDisparity out{cv::Mat1f(left.size(), kUnmeasured), cv::Mat1f(right.size(), kUnmeasured)};
  match(a, b, min_disparity, count).colRange(columns).copyTo(out.left.rowRange(rows));
  flipped(match(b_mirrored, a_mirrored, min_disparity, count)).colRange(columns).copyTo(out.right.rowRange(rows));
  return out;
}

cv::Mat1f confirmed(const cv::Mat1f& here, const cv::Mat1f& there, float towards, float tolerance_px) {
  cv::Mat1f out(here.size(), kUnmeasured);
  for (int v = 0; v < here.rows; ++v) {
    for (int u = 0; u < here.cols; ++u) {
      const float d = here(v, u);
      if (std::isnan(d)) continue;
      const int landing = static_cast<int>(std::lround(static_cast<float>(u) + towards * d));
      if (landing >= 0 && landing < here.cols && std::abs(there(v, landing) - d) <= tolerance_px) out(v, u) = d;
    }
  }
  return out;
}

}  // namespace scanrig
