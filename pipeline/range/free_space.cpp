#include "pipeline/range/free_space.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "pipeline/range/coarse_disparity.h"
#include "pipeline/silhouette/blue_screen.h"
#include "pipeline/silhouette/contour_distance.h"

namespace scanrig {
namespace {

/// What an image's matches show.
struct Seen {
  cv::Mat1b background;  ///< the table or what lies behind the working volume
  cv::Mat1b object;      ///< anything else
};

/// Points of one rectified camera.
struct Place {
  const Projection& projection;
  Transform turntable_from_camera;
  double axis_depth;
  const Rectification& rectification;

  [[nodiscard]] bool is_background(int u, int v, double depth, double clearance_mm) const {
    const Eigen::Vector3d p = turntable_from_camera * projection.unproject(u, v, depth);
    if (std::hypot(p.x(), p.z()) <= rectification.table_radius_mm) return p.y() < clearance_mm;
    return depth > axis_depth;
  }
};

Place place_of(const Rectification& r, bool is_left) {
  const Transform& t = is_left ? r.left_from_turntable : r.right_from_turntable;
  return {is_left ? r.left : r.right, t.inverse(), t.translation().z(), r};
}

cv::Mat disc(int radius) { return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}); }

Seen seen_in(const Place& place, const cv::Mat1f& disparity, const FreeSpaceOptions& options) {
  const Rectification& r = place.rectification;
  Seen seen{cv::Mat1b(disparity.size(), uchar{0}), cv::Mat1b(disparity.size(), uchar{0})};
  for (int v = 0; v < disparity.rows; ++v) {
    for (int u = 0; u < disparity.cols; ++u) {
      const double d = static_cast<double>(disparity(v, u)) - r.left.cx + r.right.cx;
      if (!(d > 0.0)) continue;  // NaN too
      const bool behind = place.is_background(u, v, r.left.fx * r.baseline_mm / d, options.clearance_mm);
      (behind ? seen.background : seen.object)(v, u) = 255;
    }
  }
  cv::erode(seen.background, seen.background, disc(options.edge_px));
  return seen;
}

/// The fine matches of the left image.
void add_range(const Place& place, const RangeImage& range, const FreeSpaceOptions& options, Seen& seen) {
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      const float depth = range.depth(v, u);
      if (std::isnan(depth)) continue;
      const bool behind = place.is_background(u, v, static_cast<double>(depth), options.clearance_mm);
      seen.background(v, u) = behind ? 255 : 0;
      seen.object(v, u) = behind ? 0 : 255;
    }
  }
}

cv::Mat1f share_of(const cv::Mat1b& mask, int window) {
  cv::Mat1f share;
  cv::boxFilter(mask, share, CV_32F, {window, window}, {-1, -1}, true, cv::BORDER_CONSTANT);
  share *= 1.0f / 255.0f;
  return share;
}

int side_of(int width, const FreeSpaceOptions& options) {
  return 2 * static_cast<int>(std::lround(0.5 * options.window_share * width)) + 1;
}

/// Whether each pixel has the light of the background around it.
cv::Mat1b like_background(const cv::Mat3f& light, const cv::Mat1b& background, const FreeSpaceOptions& options) {
  const int side = side_of(light.cols, options);
  const cv::Size window(side, side);
  cv::Mat3f masked(light.size(), cv::Vec3f::all(0.0f)), mean, square;
  light.copyTo(masked, background);
  cv::boxFilter(masked, mean, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
  cv::boxFilter(masked.mul(masked), square, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
  const cv::Mat1f share = share_of(background, side);
  cv::Mat1b like(light.size(), uchar{0});
  const float least = 10.0f / static_cast<float>(window.area());
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const float n = share(y, x);
      if (n < least) continue;
      bool same = true;
      for (int k = 0; k < 3; ++k) {
        const float m = mean(y, x)[k] / n, variance = std::max(0.0f, square(y, x)[k] / n - m * m);
        const float sigma = std::max(options.min_noise, std::sqrt(variance));
        same = same && std::abs(light(y, x)[k] - m) < options.same_sigmas * sigma;
      }
      like(y, x) = same ? 255 : 0;
    }
  }
  return like;
}

/// The parts of `all` that touch `seeds`.
cv::Mat1b joined_to(const cv::Mat1b& all, const cv::Mat1b& seeds) {
  cv::Mat1i labels;
  const int count = cv::connectedComponents(all, labels, 4, CV_32S);
  std::vector<uchar> kept(static_cast<std::size_t>(count), 0);
  for (int y = 0; y < all.rows; ++y) {
    for (int x = 0; x < all.cols; ++x) {
      if (seeds(y, x) != 0 && labels(y, x) != 0) kept[static_cast<std::size_t>(labels(y, x))] = 255;
    }
  }
  cv::Mat1b out(all.size());
  for (int y = 0; y < all.rows; ++y) {
    for (int x = 0; x < all.cols; ++x) out(y, x) = kept[static_cast<std::size_t>(labels(y, x))];
  }
  return out;
}

void grow(const cv::Mat& plain, const FreeSpaceOptions& options, Seen& seen) {
  cv::Mat3f light;
  plain.convertTo(light, CV_32F);
  cv::boxFilter(light, light, CV_32F, {3, 3}, {-1, -1}, true, cv::BORDER_REPLICATE);
  const int side = side_of(light.cols, options);
  for (int round = 0; round < options.rounds; ++round) {
    const cv::Mat1b like = like_background(light, seen.background, options);
    const cv::Mat1f alike = share_of(cv::Mat1b(like & seen.object), side);
    const cv::Mat1f object = share_of(seen.object, side);
    cv::Mat1b taken;
    cv::compare(alike, options.max_alike * object, taken, cv::CMP_LE);
    taken &= like & ~seen.object;
    cv::morphologyEx(taken | seen.background, taken, cv::MORPH_OPEN, disc(1));
    const int before = cv::countNonZero(seen.background);
    seen.background |= joined_to(cv::Mat1b(taken | seen.background), seen.background);
    if (cv::countNonZero(seen.background) == before) break;
  }
}

cv::Mat1f outline(const Seen& seen, const cv::Mat& plain) {
  if (!plain.empty()) return outline_near(plain, cv::Mat1b(255 - seen.background), seen.object);
  cv::Mat1f field(seen.background.size(), -0.5f);
  field.setTo(0.5f, seen.background);
  return contour_distance(field);
}

}  // namespace

Result<FreeSpace> free_space(const Rectification& r, const RangeImage& range, const TwoLights& left,
                             const TwoLights& right, const FreeSpaceOptions& options) {
  try {
    const int infinity = static_cast<int>(std::floor(r.left.cx - r.right.cx));
    const RectifiedPair pair{left.pattern, right.pattern,  {}, {}, r.left, r.right.cx, r.baseline_mm,
                             infinity,     r.max_disparity};
    const CoarseDisparity d = coarse_disparity(pair, object_boxes(pair, {0, left.pattern.rows}));
    const Place in_left = place_of(r, true), in_right = place_of(r, false);
    Seen seen_left = seen_in(in_left, confirmed(d.left, d.right, -1.0f, options.coarse_agreement_px), options);
    Seen seen_right = seen_in(in_right, confirmed(d.right, d.left, 1.0f, options.coarse_agreement_px), options);
    add_range(in_left, range, options, seen_left);
    if (!left.plain.empty()) grow(left.plain, options, seen_left);
    if (!right.plain.empty()) grow(right.plain, options, seen_right);
    return FreeSpace{outline(seen_left, left.plain), outline(seen_right, right.plain)};
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "range: free space: {}", error.what());
  }
}

}  // namespace scanrig
