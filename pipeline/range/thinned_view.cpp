#include "pipeline/range/thinned_view.h"

#include <algorithm>
#include <cmath>

#include "pipeline/range/crop_view.h"

namespace scanrig {
namespace {

constexpr double kThinnedPx = 1.3e6;

int steps_in(int pixels, int step) { return (pixels + step - 1) / step; }

Projection thinned(const Projection& all, int step) {
  Projection thin = all;
  thin.width = steps_in(all.width, step);
  thin.height = steps_in(all.height, step);
  thin.fx /= step;
  thin.fy /= step;
  thin.cx /= step;
  thin.cy /= step;
  thin.crop_x /= step;
  thin.crop_y /= step;
  thin.sensor_width = steps_in(all.sensor_width, step);
  thin.sensor_height = steps_in(all.sensor_height, step);
  return thin;
}

template <typename Pixel>
cv::Mat_<Pixel> thinned(const cv::Mat_<Pixel>& all, int step) {
  if (all.empty()) return {};
  cv::Mat_<Pixel> thin(steps_in(all.rows, step), steps_in(all.cols, step));
  for (int v = 0; v < thin.rows; ++v) {
    for (int u = 0; u < thin.cols; ++u) thin(v, u) = all(step * v, step * u);
  }
  return thin;
}

/// The crop of the thinned image, in pixels of the whole one as it is cropped now.
cv::Rect crop_of(const Projection& whole, const Projection& thin, int step) {
  const cv::Point first(step * thin.crop_x, step * thin.crop_y);
  const cv::Size sensor =
      thin.is_cropped() ? cv::Size(whole.sensor_width, whole.sensor_height) : cv::Size(whole.width, whole.height);
  const cv::Rect on_sensor =
      cv::Rect(first, cv::Size(step * thin.width, step * thin.height)) & cv::Rect({0, 0}, sensor);
  return on_sensor - cv::Point(whole.crop_x, whole.crop_y);
}

/// Background around a thinned pixel that is background no more. Says whether there was any.
bool forget_doubted(cv::Mat1b& background, const cv::Mat1b& thin, int step) {
  bool has_changed = false;
  const cv::Mat1b before = background.clone();
  for (int v = 0; v < background.rows; ++v) {
    const int thin_v = std::min((v + step / 2) / step, thin.rows - 1);
    for (int u = 0; u < background.cols; ++u) {
      const int thin_u = std::min((u + step / 2) / step, thin.cols - 1);
      if (before(v, u) == 0 || before(step * thin_v, step * thin_u) == 0 || thin(thin_v, thin_u) != 0) continue;
      background(v, u) = 0;
      has_changed = true;
    }
  }
  return has_changed;
}

}  // namespace

int thinning_step(const Projection& sensor) {
  const double pixels = static_cast<double>(sensor.width) * sensor.height;
  return std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / kThinnedPx))));
}

View thinned(const View& view, int step) {
  View thin = view;
  RangeImage& range = thin.range;
  range.projection = thinned(range.projection, step);
  range.depth = thinned(range.depth, step);
  range.sigma = thinned(range.sigma, step);
  range.normal = thinned(range.normal, step);
  range.background = thinned(range.background, step);
  range.window_px /= static_cast<float>(step);
  for (Silhouette& s : thin.silhouettes) {
    s.projection = thinned(s.projection, step);
    s.outside_px = thinned(s.outside_px, step) / step;
  }
  return thin;
}

void follow_thinned(CompactRange& whole, const RangeImage& thinned, int step) {
  const cv::Rect all = crop_of(whole.header().projection, thinned.projection, step);
  const bool is_wider = all.size() != cv::Size(whole.header().projection.width, whole.header().projection.height);
  RangeImage range = whole.whole();
  if (is_wider) widen(range, all);
  const bool has_changed = !range.background.empty() && forget_doubted(range.background, thinned.background, step);
  if (is_wider || has_changed) whole = CompactRange(range);
  whole.place(thinned.camera_from_pose);
}

}  // namespace scanrig
