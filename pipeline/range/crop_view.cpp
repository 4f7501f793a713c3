#include "pipeline/range/crop_view.h"

#include <algorithm>

#include "pipeline/silhouette/box_around.h"
#include "pipeline/silhouette/contour_distance.h"

namespace scanrig {
namespace {

cv::Rect aligned(const cv::Rect& box, const cv::Size& image, int step = 1) {
  const int align = step * kCropAlignPx;
  const auto down = [&](int at) { return at / align * align; };
  const auto up = [&](int at) { return (at + align - 1) / align * align; };
  const cv::Point first(down(box.x), down(box.y)), end(up(box.br().x), up(box.br().y));
  return cv::Rect(first, end) & cv::Rect({0, 0}, image);
}

cv::Rect sensor_of(const Projection& projection) {
  return projection.is_cropped() ? cv::Rect(0, 0, projection.sensor_width, projection.sensor_height)
                                 : cv::Rect(0, 0, projection.width, projection.height);
}

void crop_range(RangeImage& range, const cv::Rect& box) {
  range.projection = range.projection.cropped(box.x, box.y, box.width, box.height);
  range.depth = range.depth(box).clone();
  range.sigma = range.sigma(box).clone();
  range.normal = range.normal(box).clone();
  range.background = range.background(box).clone();
}

template <typename Pixel>
cv::Mat_<Pixel> placed(const cv::Mat_<Pixel>& image, const cv::Rect& box, const Pixel& beyond) {
  cv::Mat_<Pixel> larger(box.size(), beyond);
  image.copyTo(larger(cv::Rect({-box.x, -box.y}, image.size())));
  return larger;
}

}  // namespace

void crop_to_object(View& view) { crop_to_object_in_steps(view, 1); }

void crop_to_object_in_steps(View& view, int step) {
  const auto is_full = [](const Silhouette& s) { return !s.outside_px.empty() && !s.projection.is_cropped(); };
  if (view.range.background.empty() || !view.range.background_is_whole || view.silhouettes.empty() ||
      !std::ranges::all_of(view.silhouettes, is_full)) {
    return;
  }
  for (std::size_t camera = 0; camera < view.silhouettes.size(); ++camera) {
    Silhouette& s = view.silhouettes[camera];
    const cv::Rect box =
        aligned(box_around(cv::Mat1b(s.outside_px < 0.0F), step * kCropRoomPx), s.outside_px.size(), step);
    if (box.empty()) continue;
    if (camera == 0) crop_range(view.range, box);
    s.projection = s.projection.cropped(box.x, box.y, box.width, box.height);
    s.outside_px = s.outside_px(box).clone();
  }
}

void uncrop(View& view, std::size_t camera, const cv::Rect& box) {
  Silhouette& s = view.silhouettes[camera];
  const cv::Point first(s.projection.crop_x, s.projection.crop_y);  // on the sensor
  const cv::Rect room(box.x - kCropRoomPx, box.y - kCropRoomPx, box.width + 2 * kCropRoomPx,
                      box.height + 2 * kCropRoomPx);
  const cv::Rect all = (aligned((room + first) & sensor_of(s.projection), sensor_of(s.projection).size()) - first) |
                       cv::Rect({0, 0}, s.outside_px.size());
  if (all.size() == s.outside_px.size()) return;
  s.outside_px = distance_beyond(s.outside_px, all);
  s.projection = s.projection.cropped(all.x, all.y, all.width, all.height);
  if (camera == 0) widen(view.range, all);
}

void widen(RangeImage& range, const cv::Rect& all) {
  range.projection = range.projection.cropped(all.x, all.y, all.width, all.height);
  range.depth = placed(range.depth, all, kUnmeasured);
  range.sigma = placed(range.sigma, all, kUnmeasured);
  range.normal = placed(range.normal, all, cv::Vec3f(kUnmeasured, kUnmeasured, kUnmeasured));
  range.background = placed(range.background, all, uchar{255});
}

}  // namespace scanrig
