#include "tests/bench/pose/depth_steps.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanrig {

cv::Mat1b beside_steps(const cv::Mat1f& depth, double step_mm, int reach_px) {
  cv::Mat1b steps(depth.size(), uchar{0});
  const auto compare = [&](cv::Point a, cv::Point b) {
    const float da = depth(a), db = depth(b);
    const bool is_step = std::isnan(da) != std::isnan(db) || std::abs(da - db) > step_mm;
    if (is_step) steps(a) = steps(b) = 255;
  };
  for (int v = 0; v + 1 < depth.rows; ++v) {
    for (int u = 0; u + 1 < depth.cols; ++u) {
      compare({u, v}, {u + 1, v});
      compare({u, v}, {u, v + 1});
    }
  }
  const int width = 2 * reach_px + 1;
  cv::dilate(steps, steps, cv::getStructuringElement(cv::MORPH_ELLIPSE, {width, width}));
  return steps;
}

}  // namespace scanrig
