#include "pipeline/range/coarse_disparity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

using Disparity = std::function<float(int x, int y)>;

cv::Mat1f dots(cv::Size size, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat1f image(size);
  random.fill(image, cv::RNG::UNIFORM, 0.0F, 255.0F);
  cv::GaussianBlur(image, image, {}, 2.0);
  cv::normalize(image, image, 0.0, 255.0, cv::NORM_MINMAX);
  return image;
}

/// Dots as the right camera sees them, and the left one where `disparity` leads from its pixels; other dots where
/// something nearer covers that for the right camera.
RectifiedPair dotted_pair(cv::Size size, const Disparity& disparity) {
  RectifiedPair pair;
  pair.right = dots(size, 3);
  cv::Mat1f columns(size), rows(size), nearest(size, -1e6F);
  const auto landing = [&](int x, int y) {
    return std::clamp(static_cast<int>(std::lround(static_cast<float>(x) - disparity(x, y))), 0, size.width - 1);
  };
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      columns(y, x) = static_cast<float>(x) - disparity(x, y);
      rows(y, x) = static_cast<float>(y);
      float& there = nearest(y, landing(x, y));
      there = std::max(there, disparity(x, y));
    }
  }
  cv::remap(pair.right, pair.left, columns, rows, cv::INTER_LINEAR, cv::BORDER_REFLECT);
  const cv::Mat1f others = dots(size, 4);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (nearest(y, landing(x, y)) > disparity(x, y) + 2.0F) pair.left(y, x) = others(y, x);
    }
  }
  pair.left_object = pair.right_object = cv::Mat1b(size, uchar{255});
  pair.min_disparity = -200;
  pair.max_disparity = 200;
  return pair;
}

/// Share of `part` with disparities less than a pixel off.
double found_within(const cv::Rect& part, const RectifiedPair& pair, const Disparity& disparity) {
  const PairBoxes boxes = object_boxes(pair, {0, pair.left.rows});
  const cv::Mat1f found = coarse_disparity(pair, boxes).left;
  int right = 0;
  for (int y = part.y; y < part.br().y; ++y) {
    for (int x = part.x; x < part.br().x; ++x) right += std::abs(found(y, x) - disparity(x, y)) < 1.0F ? 1 : 0;
  }
  return 1.0 * right / part.area();
}

TEST(CoarseDisparity, FollowsASteepSurfaceThroughAllItsDisparities) {
  const Disparity ramp = [](int x, int) { return 0.45F * static_cast<float>(x - 320); };
  EXPECT_GT(found_within({60, 20, 520, 280}, dotted_pair({640, 320}, ramp), ramp), 0.98);
}

TEST(CoarseDisparity, FindsASmallPartFarBeforeTheRest) {
  const cv::Rect part(280, 120, 48, 64);  // 1.5 % of the image
  const Disparity stepped = [&](int x, int y) { return part.contains({x, y}) ? 90.0F : 0.1F * static_cast<float>(y); };
  const RectifiedPair pair = dotted_pair({640, 320}, stepped);
  EXPECT_GT(found_within({part.tl() + cv::Point(5, 5), part.size() - cv::Size(10, 10)}, pair, stepped), 0.95);
  EXPECT_GT(found_within({20, 20, 160, 280}, pair, stepped), 0.98);
}

}  // namespace
}  // namespace scanrig
