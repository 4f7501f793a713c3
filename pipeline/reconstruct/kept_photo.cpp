#include "pipeline/reconstruct/kept_photo.h"

#include <opencv2/core.hpp>

namespace scanrig {

cv::Mat3b KeptPhoto::whole() const {
  if (sensor.empty()) return pixels;
  cv::Mat3b image(sensor, cv::Vec3b(0, 0, 0));
  pixels.copyTo(image(cv::Rect(first, pixels.size())));
  return image;
}

void crop_photo(KeptPhoto& photo, const Silhouette& silhouette, const RectifyingMap& map, int step) {
  constexpr int kRoom = 4;  // px: of a sample's window
  const Projection& p = silhouette.projection;
  if (!p.is_cropped() || !photo.sensor.empty()) return;
  const cv::Rect box =
      cv::Rect(step * p.crop_x, step * p.crop_y, step * p.width, step * p.height) & cv::Rect({0, 0}, map.u.size());
  const cv::Rect kept = sensor_box(map, box, kRoom) & cv::Rect({0, 0}, photo.pixels.size());
  if (kept.empty()) return;
  photo.sensor = photo.pixels.size();
  photo.first = kept.tl();
  photo.pixels = photo.pixels(kept).clone();
}

}  // namespace scanrig
