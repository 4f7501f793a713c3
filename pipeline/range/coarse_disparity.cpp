#include "pipeline/range/coarse_disparity.h"

#include <algorithm>
#include <cmath>
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

/// Disparities to search: lowest, and how many.
struct Search {
  int lowest = 0, count = 0;

  static Search between(int lowest, int highest) {
    return {lowest, std::max(16, (highest - lowest + 16) / 16 * 16)};  // OpenCV wants a multiple of 16
  }
};

/// `is_checked`: only disparities to which the right image's cheapest ones lead back within a pixel.
cv::Mat1f match(const cv::Mat1b& here, const cv::Mat1b& there, const Search& search, int speckle_px, bool is_checked) {
  constexpr int kBlock = 5;
  const auto matcher =
      cv::StereoSGBM::create(search.lowest, search.count, kBlock, 4 * kBlock * kBlock, 24 * kBlock * kBlock,
                             is_checked ? 1 : -1, 31, 3, speckle_px, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat1s fixed;
  matcher->compute(here, there, fixed);
  cv::Mat1f disparity(fixed.size());
  const short unknown = static_cast<short>((search.lowest - 1) * 16);
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

/// The left image's disparities at the right image's pixels: the nearest surface's where several meet, the mean of both
/// sides in gaps of a pixel.
cv::Mat1f seen_from_right(const cv::Mat1f& left) {
  constexpr float kSame = 2.0F;  // px: both sides of a gap are one surface
  cv::Mat1f right(left.size(), kUnmeasured);
  for (int y = 0; y < left.rows; ++y) {
    const float* from = left[y];
    float* to = right[y];
    for (int x = 0; x < left.cols; ++x) {
      if (std::isnan(from[x])) continue;
      const int landing = static_cast<int>(std::lround(static_cast<float>(x) - from[x]));
      if (landing >= 0 && landing < left.cols && !(to[landing] >= from[x])) to[landing] = from[x];
    }
    for (int x = 1; x + 1 < left.cols; ++x) {
      if (std::isnan(to[x]) && std::abs(to[x - 1] - to[x + 1]) < kSame) to[x] = 0.5F * (to[x - 1] + to[x + 1]);
    }
  }
  return right;
}

/// Of two images of one size. `from_both`: each in its turn, for disparities that both confirm; else from the left.
CoarseDisparity match_both(const cv::Mat1b& left, const cv::Mat1b& right, const Search& search, int speckle_px,
                           bool from_both) {
  // OpenCV leaves out the columns whose search would leave the image.
  const int margin = std::max({std::abs(search.lowest), std::abs(search.lowest + search.count), 16});
  const cv::Mat1b a = widened(left, margin), b = widened(right, margin);
  if (!from_both) {
    const cv::Mat1f disparity = match(a, b, search, speckle_px, true).colRange(margin, margin + left.cols);
    return {disparity, seen_from_right(disparity)};
  }
  cv::Mat1b a_mirrored, b_mirrored;
  cv::flip(a, a_mirrored, 1);
  cv::flip(b, b_mirrored, 1);
  const cv::Range columns(margin, margin + left.cols);
  return {match(a, b, search, speckle_px, false).colRange(columns),
          flipped(match(b_mirrored, a_mirrored, search, speckle_px, false)).colRange(columns)};
}

/// Those of `search` that occur, from images a quarter as large; all of it where too few are found there.
Search occurring(const cv::Mat1b& left, const cv::Mat1b& right, const Search& search) {
  constexpr int kScale = 4, kMargin = 12, kSpeckle = 6, kFewest = 200;
  cv::Mat1b a, b;
  cv::resize(left, a, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
  cv::resize(right, b, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
  const int highest = search.lowest + search.count;
  const CoarseDisparity small =
      match_both(a, b, Search::between(search.lowest / kScale - 1, highest / kScale + 1), kSpeckle, false);
  const cv::Mat1f found = confirmed(small.left, small.right, -1.0F, 1.0F);
  cv::Mat1b known;
  cv::compare(found, found, known, cv::CMP_EQ);  // not NaN
  if (cv::countNonZero(known) < kFewest) return search;
  double least = 0.0, most = 0.0;
  cv::minMaxLoc(found, &least, &most, nullptr, nullptr, known);
  return Search::between(std::max(search.lowest, static_cast<int>(least * kScale) - kMargin),
                         std::min(highest, static_cast<int>(most * kScale) + kMargin));
}

}  // namespace

CoarseDisparity coarse_disparity(const RectifiedPair& pair, const PairBoxes& boxes) {
  const cv::Mat1b left = flattened(pair.left(boxes.left)), right = flattened(pair.right(boxes.right));
  const int shift = boxes.shift();
  Search search = Search::between(std::max(pair.min_disparity - shift, -left.cols),
                                  std::min(pair.max_disparity - shift, left.cols));
  // Masks leave no background to be matched wrongly, so one direction is enough.
  const bool has_masks = !pair.left_object.empty() && !pair.right_object.empty();
  if (has_masks) search = occurring(left, right, search);
  constexpr int kSpeckle = 60;
  const CoarseDisparity within = match_both(left, right, search, kSpeckle, !has_masks);
  const cv::Size size = pair.left.size();
  CoarseDisparity out{cv::Mat1f(size, kUnmeasured), cv::Mat1f(size, kUnmeasured)};
  cv::add(within.left, static_cast<double>(shift), out.left(boxes.left));
  cv::add(within.right, static_cast<double>(shift), out.right(boxes.right));
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
