#include "pipeline/reconstruct/kept_photo.h"

#include <cmath>
#include <opencv2/core.hpp>

namespace scanrig {

cv::Mat3b KeptPhoto::whole() const {
  if (sensor.empty()) return pixels;
  cv::Mat3b image(sensor, cv::Vec3b(0, 0, 0));
  pixels.copyTo(image(cv::Rect(first, pixels.size())));
  return image;
}

void crop_photo(KeptPhoto& photo, const Silhouette& silhouette, const RectifyingMap& map) {
  constexpr int kRoom = 4;  // px: of a sample's window
  const Projection& p = silhouette.projection;
  if (!p.is_cropped() || !photo.sensor.empty()) return;
  const cv::Rect box = cv::Rect(p.crop_x, p.crop_y, p.width, p.height) & cv::Rect({0, 0}, map.u.size());
  double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
  cv::minMaxLoc(map.u(box), &left, &right);
  cv::minMaxLoc(map.v(box), &top, &bottom);
  const cv::Point first(static_cast<int>(std::floor(left)) - kRoom, static_cast<int>(std::floor(top)) - kRoom);
  const cv::Point end(static_cast<int>(std::ceil(right)) + kRoom, static_cast<int>(std::ceil(bottom)) + kRoom);
  const cv::Rect kept = cv::Rect(first, end) & cv::Rect({0, 0}, photo.pixels.size());
  if (kept.empty()) return;
  photo.sensor = photo.pixels.size();
  photo.first = kept.tl();
  photo.pixels = photo.pixels(kept).clone();
}

}  // namespace scanrig
