#include "pipeline/texture/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace scanrig {
namespace {

constexpr int kRounds = 10;
constexpr double kSettled = 1e-3;  // px

/// Where `patch` (around `centre` of the image it was cut from) lies in `photo`, as a shift: the whole pixels by phase
/// correlation, the fraction by least squares on the grey levels, whose means may differ.
cv::Point2d shift_of(const cv::Mat1f& patch, cv::Point2f centre, const cv::Mat1f& photo, const cv::Mat1f& window) {
  cv::Mat1f there;
  cv::getRectSubPix(photo, patch.size(), centre, there);
  const cv::Mat1f rendered(patch - cv::mean(patch)[0]);
  const cv::Point2d start = cv::phaseCorrelate(rendered, there - cv::mean(there)[0], window);

  cv::Mat1f dx, dy;
  cv::Sobel(rendered, dx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(rendered, dy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  const cv::Mat1f wx(dx.mul(window));
  const cv::Mat1f wy(dy.mul(window));
  const cv::Matx22d normal(wx.dot(dx), wx.dot(dy), wx.dot(dy), wy.dot(dy));
  if (cv::determinant(normal) <= 0.0) return start;
  cv::Point2d shift = start;
  for (int round = 0; round < kRounds; ++round) {
    cv::getRectSubPix(photo, patch.size(), centre + cv::Point2f(shift), there);
    const cv::Mat1f rest(rendered - (there - cv::mean(there)[0]));
    const cv::Vec2d step = normal.inv() * cv::Vec2d(wx.dot(rest), wy.dot(rest));
    shift += cv::Point2d(step);
    if (cv::norm(step) < kSettled) break;
  }
  return cv::norm(shift - start) < 2.0 ? shift : start;
}

}  // namespace

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

  const auto grey = [](const cv::Mat3b& image) {
    cv::Mat3f fine;
    cv::Mat1f one;
    image.convertTo(fine, CV_32F);
    cv::cvtColor(fine, one, cv::COLOR_BGR2GRAY);
    return one;
  };
  const cv::Mat1f grey_rendered = grey(rendered);
  const cv::Mat1f grey_photo = grey(photo);
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
      const cv::Point2f centre(static_cast<float>(x + 0.5 * (patch.width - 1)),
                               static_cast<float>(y + 0.5 * (patch.height - 1)));
      const cv::Point2d shift = shift_of(grey_rendered(at), centre, grey_photo, window);
      offsets.push_back(cv::norm(shift));
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
