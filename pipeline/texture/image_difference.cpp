#include "pipeline/texture/image_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace scanrig {
namespace {

constexpr double kNoise = 2.0;  // grey levels
constexpr int kAlignmentRounds = 30;
constexpr double kSettled = 1e-3;  // px

/// A piece of the rendering with the matrices for placing it by least squares.
class Patch {
 public:
  Patch(const cv::Mat1f& grey, const cv::Mat1f& window) : window_(window) {
    cv::subtract(grey, cv::mean(grey), grey_);
    cv::Mat1f dx, dy;
    cv::Sobel(grey_, dx, CV_32F, 1, 0, 3, 1.0 / 8.0);
    cv::Sobel(grey_, dy, CV_32F, 0, 1, 3, 1.0 / 8.0);
    wx_ = dx.mul(window);
    wy_ = dy.mul(window);
    normal_ = {wx_.dot(dx), wx_.dot(dy), wx_.dot(dy), wy_.dot(dy)};
  }

  /// Standard deviation of its place along the worst direction.
  [[nodiscard]] double sigma() const {
    const double half = 0.5 * (normal_(0, 0) + normal_(1, 1));
    const double min_eigenvalue = half - std::sqrt(std::max(0.0, half * half - cv::determinant(normal_)));
    return kNoise / std::sqrt(std::max(min_eigenvalue, 1e-9));
  }

  /// Its place in `photo`, relative to `centre`: the whole pixels by phase correlation, the fraction by least squares
  /// on the grey levels, whose means may differ.
  [[nodiscard]] cv::Point2d shift(cv::Point2f centre, const cv::Mat1f& photo) const {
    cv::Mat1f there;
    cv::getRectSubPix(photo, grey_.size(), centre, there);
    cv::subtract(there, cv::mean(there), there);
    // Copies: phaseCorrelate of OpenCV 4.6 multiplies its inputs by the window in place.
    const cv::Point2d start = cv::phaseCorrelate(grey_.clone(), there.clone(), window_);
    cv::Point2d shift = start;
    for (int round = 0; round < kAlignmentRounds; ++round) {
      cv::getRectSubPix(photo, grey_.size(), centre + cv::Point2f(shift), there);
      cv::subtract(there, cv::mean(there), there);
      cv::subtract(grey_, there, there);
      const cv::Vec2d step = normal_.inv() * cv::Vec2d(wx_.dot(there), wy_.dot(there));
      shift += cv::Point2d(step);
      if (cv::norm(step) < kSettled) break;
    }
    return cv::norm(shift - start) < 2.0 ? shift : start;
  }

 private:
  cv::Mat1f window_, grey_, wx_, wy_;
  cv::Matx22d normal_;
};

}  // namespace

Result<ImageDifference> compare_images(const cv::Mat3b& rendered, const cv::Mat3b& photo, const cv::Mat1b& mask,
                                       const ComparisonOptions& options) {
  if (rendered.size() != photo.size() || mask.size() != photo.size()) {
    return fail(ErrorCode::invalid_input, "compare images: {} x {} against {} x {}, mask {} x {}", rendered.cols,
                rendered.rows, photo.cols, photo.rows, mask.cols, mask.rows);
  }
  cv::Mat1b inside;
  const int side = 2 * options.erosion_px + 1;
  cv::erode(mask, inside, cv::getStructuringElement(cv::MORPH_RECT, {side, side}), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  const int pixels = cv::countNonZero(inside);
  if (pixels == 0) return fail(ErrorCode::degenerate, "compare images: the eroded mask is empty");

  ImageDifference result;
  const double difference = cv::norm(rendered, photo, cv::NORM_L2, inside);
  result.psnr_db = 20.0 * std::log10(255.0 / std::max(1e-6, difference / std::sqrt(3.0 * pixels)));

  // Without its low frequencies: light that the lamp model misses is a slope across a patch, and would shift it.
  const auto grey = [&](const cv::Mat3b& image) {
    cv::Mat3f fine;
    cv::Mat1f one, slow;
    image.convertTo(fine, CV_32F);
    cv::cvtColor(fine, one, cv::COLOR_BGR2GRAY);
    cv::GaussianBlur(one, slow, {}, options.patch_px / 8.0);
    cv::subtract(one, slow, one);
    return one;
  };
  cv::Mat3b pasted = photo.clone();  // no step at the outline, whatever the backdrops
  rendered.copyTo(pasted, mask);
  const cv::Mat1f grey_rendered = grey(pasted);
  const cv::Mat1f grey_photo = grey(photo);
  cv::Mat1f window;
  const cv::Size patch(options.patch_px, options.patch_px);
  cv::createHanningWindow(window, patch, CV_32F);
  std::vector<double> offsets;
  for (int y = 0; y + patch.height <= photo.rows; y += patch.height / 2) {
    for (int x = 0; x + patch.width <= photo.cols; x += patch.width / 2) {
      const cv::Rect at(cv::Point(x, y), patch);
      if (cv::countNonZero(inside(at)) < at.area()) continue;
      const Patch piece(grey_rendered(at), window);
      if (piece.sigma() > options.patch_sigma_px) continue;
      const cv::Point2f centre(static_cast<float>(x + 0.5 * (patch.width - 1)),
                               static_cast<float>(y + 0.5 * (patch.height - 1)));
      offsets.push_back(cv::norm(piece.shift(centre, grey_photo)));
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
