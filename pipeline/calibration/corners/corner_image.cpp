#include "pipeline/calibration/corners/corner_image.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

constexpr int kSaturated = 254;  // grey levels

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
