#include "pipeline/volume/range_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kTile = 16;
constexpr int kBeside[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
constexpr int kNeighbours[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}};

}  // namespace

RangeSampler::RangeSampler(const RangeImage& range, const Transform& model_from_pose, double band_mm, double voxel_mm,
                           const RangeSamplerOptions& options)
    : options_(options),
      camera_from_model_(range.camera_from_pose * model_from_pose.inverse()),
      rotation_(camera_from_model_.linear().cast<float>()),
      translation_(camera_from_model_.translation().cast<float>()),
      has_outline_(!range.background.empty() && range.background_is_whole),
      band_mm_(static_cast<float>(band_mm)) {
  crop(range);
  set_area({0, 0, width_, height_});
  make_planes(range, {0, 0});
  close_pinholes();
  voxel_pixels_ = std::max(1, static_cast<int>(std::ceil(voxel_mm / mm_per_pixel())));
  window_mm_ = range.window_px * static_cast<float>(mm_per_pixel());
  drop_specks_and_fade_edges(voxel_pixels_);
  make_tiles();
  if (!has_outline_) make_footprint();
  erode_free_depth(voxel_pixels_);
}

/// Farther than this from a pixel nothing changes it: pinholes, specks with the surface that joins them, fading,
/// erosion.
int RangeSampler::margin() const {
  return 3 * voxel_pixels_ + options_.pinhole_passes + static_cast<int>(std::ceil(options_.fade_px)) + 4;
}

cv::Rect RangeSampler::area_for(const Eigen::AlignedBox3f& box) const {
  const cv::Rect all(0, 0, width_, height_);
  Eigen::AlignedBox2f seen;
  for (int i = 0; i < 8; ++i) {
    const auto at = project(box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i)));
    if (projection_.kind == Projection::Kind::pinhole && !(at.depth > 0.0F)) return all;
    seen.extend(Eigen::Vector2f(at.u, at.v));
  }
  // Of a point its four neighbours are sampled; a pixel more for rounding.
  const Eigen::Array2f last(static_cast<float>(width_), static_cast<float>(height_));
  const Eigen::Array2f low = (seen.min().array().floor() - 1.0F).max(0.0F).min(last);
  const Eigen::Array2f high = (seen.max().array().floor() + 3.0F).max(0.0F).min(last);
  const cv::Point first(static_cast<int>(low.x()), static_cast<int>(low.y()));
  const cv::Point end(static_cast<int>(high.x()), static_cast<int>(high.y()));
  if (first.x >= end.x || first.y >= end.y) return {};
  const cv::Point around(margin(), margin());
  return cv::Rect(first - around, end + around) & all;
}

void RangeSampler::focus(const Eigen::AlignedBox3f& box, const PartSource& part) {
  set_area(area_for(box));
  if (area_.empty()) return;
  make_planes(part(area_ + crop_.tl()), crop_.tl() + area_.tl());
  close_pinholes();
  drop_specks_and_fade_edges(voxel_pixels_);
  erode_free_depth(voxel_pixels_);
}

void RangeSampler::set_area(const cv::Rect& area) {
  static_assert(sizeof(Pixel) == kBytesPerPixel);
  area_ = area;
  pixels_ = std::vector<Pixel>(static_cast<std::size_t>(area.area()));
}

/// Everything outside the crop is background, or everything is unknown.
void RangeSampler::crop(const RangeImage& range) {
  int x0 = range.depth.cols, x1 = -1, y0 = range.depth.rows, y1 = -1;
  for (int y = 0; y < range.depth.rows; ++y) {
    for (int x = 0; x < range.depth.cols; ++x) {
      const bool dull =
          std::isnan(range.depth(y, x)) &&
          (has_outline_ ? range.background(y, x) != 0 : range.background.empty() || range.background(y, x) == 0);
      if (dull) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y);
    }
  }
  const int margin = 2;  // so that a window around the last measured pixel stays inside
  const cv::Rect image(0, 0, range.depth.cols, range.depth.rows);
  crop_ = x1 < 0 ? cv::Rect(0, 0, 0, 0)
                 : cv::Rect(x0 - margin, y0 - margin, x1 - x0 + 1 + 2 * margin, y1 - y0 + 1 + 2 * margin) & image;
  width_ = crop_.width;
  height_ = crop_.height;
  projection_ = range.projection.cropped(crop_.x, crop_.y, crop_.width, crop_.height);
}

/// `first`: of the pixels of `range`, in the whole image.
void RangeSampler::make_planes(const RangeImage& range, const cv::Point& first) {
  const Eigen::Matrix3f model_from_camera = rotation_.transpose();
  for (int y = area_.y; y < area_.br().y; ++y) {
    for (int x = area_.x; x < area_.br().x; ++x) {
      const int u = x + crop_.x - first.x, v = y + crop_.y - first.y;
      Pixel& p = pixel(x, y);
      const float depth = range.depth(v, u);
      if (std::isnan(depth)) {
        if (!range.background.empty() && range.background(v, u) != 0)
          p = {.free_depth = kInfinity, .state = State::background};
        continue;
      }
      const auto& n = range.normal(v, u);
      const Eigen::Vector3f normal(n[0], n[1], n[2]);
      const Eigen::Vector3f point = projection_.unproject(x, y, depth).cast<float>();
      const Eigen::Vector3f ray = projection_.kind == Projection::Kind::pinhole ? Eigen::Vector3f(point.normalized())
                                                                                : Eigen::Vector3f::UnitZ();
      const float cosine = -normal.dot(ray);
      if (!(cosine > options_.min_facing)) continue;
      if (std::isnan(range.sigma(v, u))) continue;
      const float sigma = std::max(range.sigma(v, u), options_.min_sigma_mm);
      p.normal = model_from_camera * normal;
      p.offset = normal.dot(point) - normal.dot(translation_);
      p.weight = cosine / (sigma * sigma);
      p.sigma = sigma * cosine;
      p.free_depth = depth;
      p.state = State::surface;
    }
  }
}

/// Taken from the first measured pixel on the object.
double RangeSampler::mm_per_pixel() const {
  for (const auto& p : pixels_) {
    if (p.state == State::surface) return projection_.mm_per_pixel(p.free_depth);
  }
  return projection_.mm_per_pixel(1.0);
}

/// Where the ray of pixel (x, y) meets a tangent plane, as depth.
float RangeSampler::depth_on_plane(const Pixel& plane, int x, int y) const {
  const Eigen::Vector3d start = projection_.unproject(x, y, 0.0);
  const Eigen::Vector3d ray = projection_.unproject(x, y, 1.0) - start;
  const Eigen::Vector3f normal = rotation_ * plane.normal;
  const double offset = plane.offset + normal.dot(translation_);
  return static_cast<float>((offset - normal.cast<double>().dot(start)) / normal.cast<double>().dot(ray));
}

Eigen::Vector3f RangeSampler::point_on(const Pixel& plane, int x, int y) const {
  const Eigen::Vector3f in_camera = projection_.unproject(x, y, depth_on_plane(plane, x, y)).cast<float>();
  return rotation_.transpose() * (in_camera - translation_);
}

/// Each pixel's point lies near the other's tangent plane.
bool RangeSampler::one_surface(const std::vector<Eigen::Vector3f>& points, std::size_t i, std::size_t j) const {
  const Pixel &a = pixels_[i], &b = pixels_[j];
  const float tolerance = options_.max_step * band_mm_;
  return std::abs(a.normal.dot(points[j]) - a.offset) < tolerance &&
         std::abs(b.normal.dot(points[i]) - b.offset) < tolerance;
}

/// Unknown pixels with at least five measured neighbours that agree take the neighbours' mean plane; twice, so that
/// gaps of up to four pixels close: less than a matching window, so no surface is invented.
void RangeSampler::close_pinholes() {
  for (int pass = 0; pass < options_.pinhole_passes; ++pass) {
    const std::vector<Pixel> before = pixels_;
    for (int y = area_.y + 1; y + 1 < area_.br().y; ++y) {
      for (int x = area_.x + 1; x + 1 < area_.br().x; ++x) {
        if (pixel(x, y).state != State::unknown) continue;
        Eigen::Vector3f normal = Eigen::Vector3f::Zero();
        float depth = 0.0F, nearest = kInfinity, farthest = -kInfinity, weight = kInfinity, sigma = 0.0F;
        int count = 0;
        for (const auto& [dx, dy] : kNeighbours) {
          const Pixel& q = before[index(x + dx, y + dy)];
          if (q.state != State::surface) continue;
          const float z = depth_on_plane(q, x, y);
          nearest = std::min(nearest, z);
          farthest = std::max(farthest, z);
          depth += z;
          normal += q.normal;
          weight = std::min(weight, q.weight);
          sigma = std::max(sigma, q.sigma);
          ++count;
        }
        if (count < options_.min_pinhole_neighbours || farthest - nearest > options_.max_step * band_mm_) continue;
        Pixel filled{.normal = normal.normalized(),
                     .weight = weight,
                     .sigma = sigma,
                     .free_depth = depth / static_cast<float>(count),
                     .state = State::surface};
        const Eigen::Vector3f in_camera = projection_.unproject(x, y, filled.free_depth).cast<float>();
        filled.offset = filled.normal.dot(rotation_.transpose() * (in_camera - translation_));
        pixel(x, y) = filled;
      }
    }
  }
}

/// Removes patches and strips too narrow to span a few voxels: the free space in front of them would be a thread that
/// voxels resolve into beads and loops. Weights of the rest fade towards the edges.
void RangeSampler::drop_specks_and_fade_edges(int radius) {
  if (pixels_.empty()) return;
  const cv::Point first = area_.tl(), end = area_.br();
  std::vector<Eigen::Vector3f> points(pixels_.size());
  for (int y = first.y; y < end.y; ++y) {
    for (int x = first.x; x < end.x; ++x) {
      if (pixel(x, y).state == State::surface) points[index(x, y)] = point_on(pixel(x, y), x, y);
    }
  }
  cv::Mat1b inner(area_.size(), uchar{0});
  for (int y = first.y + 1; y + 1 < end.y; ++y) {
    for (int x = first.x + 1; x + 1 < end.x; ++x) {
      if (pixel(x, y).state != State::surface) continue;
      const bool joined = std::all_of(std::begin(kBeside), std::end(kBeside), [&](const auto& step) {
        return pixel(x + step[0], y + step[1]).state == State::surface &&
               one_surface(points, index(x, y), index(x + step[0], y + step[1]));
      });
      if (joined) inner(y - first.y, x - first.x) = 255;
    }
  }
  cv::Mat1f to_edge, to_core;
  cv::distanceTransform(inner, to_edge, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(to_edge < static_cast<float>(radius), to_core, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int y = 0; y < area_.height; ++y) {
    for (int x = 0; x < area_.width; ++x) {
      Pixel& p = pixel(first.x + x, first.y + y);
      if (p.state != State::surface) continue;
      if (to_core(y, x) > static_cast<float>(radius) + 1.0F) p = Pixel{};
      p.weight *= std::min(1.0F, (1.0F + to_edge(y, x)) / options_.fade_px);
    }
  }
}

void RangeSampler::erode_free_depth(int radius) {
  if (pixels_.empty()) return;
  cv::Mat1f depth(area_.size());
  const auto free_depth = [](const Pixel& p) { return std::min(p.free_depth, std::numeric_limits<float>::max()); };
  std::transform(pixels_.begin(), pixels_.end(), depth.begin(), free_depth);
  cv::Mat1f eroded;
  const int size = 2 * radius + 1;
  cv::erode(depth, eroded, cv::getStructuringElement(cv::MORPH_RECT, {size, size}));
  auto at = eroded.begin();
  for (Pixel& p : pixels_) p.free_depth = *at++;
}

/// The measured pixels, gaps bridged and enclosed holes filled.
void RangeSampler::make_footprint() {
  if (pixels_.empty()) return;
  const int gap = std::max(1, static_cast<int>(std::lround(options_.footprint_gap_mm / mm_per_pixel())));
  const int margin = 2 * gap + 2;
  cv::Mat1b mask(height_ + 2 * margin, width_ + 2 * margin, uchar{0});
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (pixel(x, y).state == State::surface) mask(y + margin, x + margin) = 255;
    }
  }
  cv::Mat1f distance;  // closing by distance: a disc, whatever its size
  cv::distanceTransform(255 - mask, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat1b grown(distance <= static_cast<float>(gap));
  cv::floodFill(grown, cv::Point(0, 0), 128);  // from outside; what stays 0 is enclosed
  cv::distanceTransform(grown != 128, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat1b closed(distance > static_cast<float>(gap));
  cv::Mat1f outside, inside;
  cv::distanceTransform(closed == 0, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(closed, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  footprint_px_ = outside - inside;
  footprint_px_ = footprint_px_(cv::Rect(margin, margin, width_, height_)).clone();
}

void RangeSampler::make_tiles() {
  tile_reach_ = cv::Mat1f((height_ + kTile - 1) / kTile, (width_ + kTile - 1) / kTile, 0.0F);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Pixel& p = pixel(x, y);
      float reach = p.free_depth;
      if (p.state == State::surface) {
        const Eigen::Vector3d ray = projection_.unproject(x, y, 1.0) - projection_.unproject(x, y, 0.0);
        reach += 1.5F * band_mm_ / std::abs((rotation_ * p.normal).dot(ray.cast<float>()));
      }
      float& tile = tile_reach_(y / kTile, x / kTile);
      tile = std::max(tile, reach);
    }
  }
}

RangeSampler::PixelPosition RangeSampler::project(const Eigen::Vector3f& point) const {
  const Eigen::Vector3f p = rotation_ * point + translation_;
  const float scale = projection_.kind == Projection::Kind::pinhole ? 1.0F / p.z() : 1.0F;
  return {static_cast<float>(projection_.fx) * p.x() * scale + static_cast<float>(projection_.cx),
          static_cast<float>(projection_.fy) * p.y() * scale + static_cast<float>(projection_.cy), p.z()};
}

RangeSample RangeSampler::sample(const Eigen::Vector3f& point) const {
  const PixelPosition at = project(point);
  RangeSample result;
  if (projection_.kind == Projection::Kind::pinhole && !(at.depth > 0.0F)) return result;
  if (!(at.u >= 0.0F && at.v >= 0.0F && at.u < static_cast<float>(width_ - 1) &&
        at.v < static_cast<float>(height_ - 1))) {
    if (!has_outline_ || !projection_.is_cropped_off({at.u, at.v})) return result;
    result.kind = RangeSample::Kind::free;
    result.clearly_free = true;
    result.distance = kInfinity;
    return result;
  }
  const int x = static_cast<int>(at.u), y = static_cast<int>(at.v);
  const float a = at.u - static_cast<float>(x), b = at.v - static_cast<float>(y);
  const Pixel* const corner[4] = {&pixel(x, y), &pixel(x + 1, y), &pixel(x, y + 1), &pixel(x + 1, y + 1)};
  const float share[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
  float nearest = kInfinity, farthest = -kInfinity, mean = 0.0F;
  int background = 0;
  for (int i = 0; i < 4; ++i) {
    if (corner[i]->state == State::unknown) return result;
    if (corner[i]->state == State::background) {
      ++background;
      continue;
    }
    const float d = corner[i]->normal.dot(point) - corner[i]->offset;
    nearest = std::min(nearest, d);
    farthest = std::max(farthest, d);
    mean += share[i] * d;
    result.weight += share[i] * corner[i]->weight;
    result.sigma += share[i] * corner[i]->sigma;
    result.normal += share[i] * corner[i]->normal;
  }
  if (background == 4 || nearest >= band_mm_) {
    result.kind = RangeSample::Kind::free;
    const float free_depth = pixel(a < 0.5F ? x : x + 1, b < 0.5F ? y : y + 1).free_depth;
    result.clearly_free = at.depth < free_depth - band_mm_;
    result.distance = nearest;
  } else if (background == 0 && farthest <= -band_mm_) {
    result.kind = RangeSample::Kind::behind;
    result.distance = farthest;
  } else if (background == 0 && farthest - nearest < options_.max_step * band_mm_ && std::abs(mean) < band_mm_) {
    result.kind = RangeSample::Kind::surface;
    result.distance = mean;
  }
  return result;
}

bool RangeSampler::has_no_data_near(const Eigen::Vector3f& point, float radius) const {
  const PixelPosition at = project(point);
  const bool pinhole = projection_.kind == Projection::Kind::pinhole;
  if (pinhole && at.depth <= radius) return false;
  const float pixels =
      radius * static_cast<float>(std::max(projection_.fx, projection_.fy)) / (pinhole ? at.depth - radius : 1.0F) + 2;
  const bool touches_outside = at.u < pixels || at.v < pixels || at.u + pixels > static_cast<float>(width_ - 1) ||
                               at.v + pixels > static_cast<float>(height_ - 1);
  if (touches_outside && has_outline_) return false;
  const auto tile = [](float position, int count) {
    return std::clamp(static_cast<int>(position) / kTile, 0, count - 1);
  };
  if (tile_reach_.empty()) return true;
  for (int ty = tile(at.v - pixels, tile_reach_.rows); ty <= tile(at.v + pixels, tile_reach_.rows); ++ty) {
    for (int tx = tile(at.u - pixels, tile_reach_.cols); tx <= tile(at.u + pixels, tile_reach_.cols); ++tx) {
      if (tile_reach_(ty, tx) > at.depth - radius) return false;
    }
  }
  return true;
}

float RangeSampler::beside_footprint_mm(const Eigen::Vector3f& point) const {
  if (footprint_px_.empty()) return -kInfinity;
  const PixelPosition at = project(point);
  if (projection_.kind == Projection::Kind::pinhole && !(at.depth > 0.0F)) return -kInfinity;
  // Beyond the crop the distance to the crop is added; points outside the image are beside everything measured too.
  const float u = std::clamp(at.u, 0.0F, static_cast<float>(width_ - 1));
  const float v = std::clamp(at.v, 0.0F, static_cast<float>(height_ - 1));
  const int x = std::min(static_cast<int>(u), width_ - 2), y = std::min(static_cast<int>(v), height_ - 2);
  const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
  const float distance = (1 - b) * ((1 - a) * footprint_px_(y, x) + a * footprint_px_(y, x + 1)) +
                         b * ((1 - a) * footprint_px_(y + 1, x) + a * footprint_px_(y + 1, x + 1));
  const float beyond = std::hypot(at.u - u, at.v - v);
  return (distance + beyond) * static_cast<float>(projection_.mm_per_pixel(at.depth)) - options_.footprint_margin_mm;
}

Eigen::Vector3d RangeSampler::towards_camera(const Eigen::Vector3d& point) const {
  const Transform model_from_camera = camera_from_model_.inverse();
  if (projection_.kind == Projection::Kind::orthographic) return -model_from_camera.linear().col(2);
  return (model_from_camera.translation() - point).normalized();
}

std::vector<RangeSampler::SurfacePixel> RangeSampler::surface() const {
  std::vector<SurfacePixel> result;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Pixel& p = pixel(x, y);
      if (p.state == State::surface) result.push_back({point_on(p, x, y), p.weight, p.sigma});
    }
  }
  return result;
}

}  // namespace scanrig
