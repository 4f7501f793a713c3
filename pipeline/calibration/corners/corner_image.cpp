#include "pipeline/calibration/corners/corner_image.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "core/statistics.h"

namespace scanrig {
namespace {

constexpr int kSaturated = 254;        // grey levels
constexpr double kMinContrast = 50.0;  // likewise
constexpr double kDarkest = 0.02;      // shares of the pixels
constexpr double kBrightest = 0.98;
constexpr double kSteepest = 0.9995;

}  // namespace

double CornerImage::value(int x, int y) const {
  if (raw.channels() == 1) return raw.at<uchar>(y, x);
  const auto& bgr = raw.at<cv::Vec3b>(y, x);
  return 0.25 * bgr[0] + 0.5 * bgr[1] + 0.25 * bgr[2];
}

bool CornerImage::is_saturated(int x, int y) const {
  if (raw.channels() == 1) return raw.at<uchar>(y, x) >= kSaturated;
  const auto& bgr = raw.at<cv::Vec3b>(y, x);
  return std::max({bgr[0], bgr[1], bgr[2]}) >= kSaturated;
}

std::optional<double> steepest_edge_px(const cv::Mat1b& grey) {
  std::vector<double> values, steps;
  for (int y = 1; y + 1 < grey.rows; ++y) {
    for (int x = 1; x + 1 < grey.cols; ++x) {
      values.push_back(grey(y, x));
      steps.push_back(std::hypot(grey(y, x + 1) - grey(y, x - 1), grey(y + 1, x) - grey(y - 1, x)));
    }
  }
  if (values.empty()) return std::nullopt;
  const double contrast = quantile(values, kBrightest) - quantile(values, kDarkest);
  if (contrast < kMinContrast) return std::nullopt;
  const double slope = 0.5 * std::max(1.0, quantile(std::move(steps), kSteepest));
  return contrast / (slope * std::sqrt(2.0 * M_PI));
}

Result<CornerImage> make_corner_image(const cv::Mat& image, const std::string& pixel_format) {
  const bool is_mosaic = pixel_format == "BayerRG8";
  if (!is_mosaic && pixel_format != "Mono8" && pixel_format != "BGR8") {
    return fail(ErrorCode::invalid_input, "board: unknown pixel format \"{}\"; use Mono8, BayerRG8 or BGR8",
                pixel_format);
  }
  if (image.empty() || image.type() != (pixel_format == "BGR8" ? CV_8UC3 : CV_8UC1)) {
    return fail(ErrorCode::invalid_input, "board: the image is not {}; check the file", pixel_format);
  }
  CornerImage made{image, is_mosaic ? 3 : 1, {}};
  try {
    if (is_mosaic) {
      const cv::Matx13f kernel(0.25F, 0.5F, 0.25F);  // its weights of red, green and blue are 1:2:1 at every site
      cv::sepFilter2D(image, made.grey, CV_8U, kernel, kernel, cv::Point(-1, -1), 0.0, cv::BORDER_REFLECT_101);
    } else if (image.channels() == 3) {
      cv::transform(image, made.grey, cv::Matx13f(0.25F, 0.5F, 0.25F));
    } else {
      made.grey = image;
    }
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "board: OpenCV failed: {}", error.what());
  }
  return made;
}

}  // namespace scanrig
