#include "pipeline/texture/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace scanrig {

Result<Comparison> compare_images(const cv::Mat3b& rendered, const cv::Mat3b& photo, const cv::Mat1b& mask,
                                  const ComparisonOptions& options) {
  if (rendered.size() != photo.size() || mask.size() != photo.size()) {
    return fail(ErrorCode::invalid_input, "compare images: {} x {} against {} x {}, mask {} x {}", rendered.cols,
                rendered.rows, photo.cols, photo.rows, mask.cols, mask.rows);
  }
  cv::Mat1b inside;
  const int side = 2 * options.erosion_px + 1;
  cv::erode(mask, inside, cv::getStructuringElement(cv::MORPH_RECT, {side, side}), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  const int pixels = cv::countNonZero(inside);
  if (pixels == 0) return fail(ErrorCode::degenerate, "compare images: nothing is left of the mask");

  Comparison result;
  const double difference = cv::norm(rendered, photo, cv::NORM_L2, inside);
  result.psnr_db = 20.0 * std::log10(255.0 / std::max(1e-6, difference / std::sqrt(3.0 * pixels)));

  cv::Mat1b grey_rendered, grey_photo;
  cv::cvtColor(rendered, grey_rendered, cv::COLOR_BGR2GRAY);
  cv::cvtColor(photo, grey_photo, cv::COLOR_BGR2GRAY);
  cv::Mat1f window;
  const cv::Size patch(options.patch_px, options.patch_px);
  cv::createHanningWindow(window, patch, CV_32F);
  std::vector<double> offsets;
  for (int y = 0; y + patch.height <= photo.rows; y += patch.height / 2) {
    for (int x = 0; x + patch.width <= photo.cols; x += patch.width / 2) {
      const cv::Rect at(cv::Point(x, y), patch);
      if (cv::countNonZero(inside(at)) < at.area()) continue;
      cv::Scalar mean, deviation;
      cv::meanStdDev(grey_photo(at), mean, deviation);
      if (deviation[0] < options.least_contrast) continue;
      cv::Mat1f a, b;
      grey_rendered(at).convertTo(a, CV_32F, 1.0, -cv::mean(grey_rendered(at))[0]);
      grey_photo(at).convertTo(b, CV_32F, 1.0, -mean[0]);
      const cv::Point2d shift = cv::phaseCorrelate(a, b, window);
      offsets.push_back(std::hypot(shift.x, shift.y));
    }
  }
  std::sort(offsets.begin(), offsets.end());
  const auto quantile = [&](double q) {
    return offsets.empty() ? std::numeric_limits<double>::quiet_NaN()
                           : offsets[static_cast<std::size_t>(q * static_cast<double>(offsets.size() - 1))];
  };
  result.patches = static_cast<int>(offsets.size());
  result.median_offset_px = quantile(0.5);
  result.p95_offset_px = quantile(0.95);
  return result;
}

}  // namespace scanrig
