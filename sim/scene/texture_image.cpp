#include "sim/scene/texture_image.h"

#include <opencv2/imgproc.hpp>

#include "core/image_codec.h"

namespace scanrig::sim {

Result<cv::Mat> decode_texture(std::string_view bytes) {
  if (bytes.starts_with("\xff\xd8")) return decode_jpeg(bytes);
  auto image = decode_camera_image(bytes);
  if (!image) return image;
  if (image->depth() == CV_16U) image->convertTo(*image, CV_8U, 1.0 / 257);
  if (image->channels() == 1) cv::cvtColor(*image, *image, cv::COLOR_GRAY2BGR);
  return image;
}

}  // namespace scanrig::sim
