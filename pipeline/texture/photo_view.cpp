#include "pipeline/texture/photo_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/units.h"
#include "pipeline/texture/four_lanes.h"
#include "pipeline/texture/rounding.h"

namespace scanrig {
namespace {

/// Two neighbouring pixels whose depths differ by more than this many pixel widths belong to two surfaces: steeper than
/// any used incidence (tan 79 deg).
constexpr float kStep = 5.0F;
/// A point may lie this many pixel widths behind the mapped surface: half a pixel of the steepest slope.
constexpr double kSlack = 3.0;

/// Catmull-Rom weights of the four pixels around a fraction.
std::array<float, 4> cubic(float t) {
  const float t2 = t * t;
  const float t3 = t2 * t;
  return {0.5F * (-t3 + 2.0F * t2 - t), 0.5F * (3.0F * t3 - 5.0F * t2 + 2.0F), 0.5F * (-3.0F * t3 + 4.0F * t2 + t),
          0.5F * (t3 - t2)};
}

/// Four pixels of a row from column `x` on, in the first twelve of sixteen bytes; the border's pixel beyond the sensor
/// and black beyond the part that is held, for which `copy` has room.
const uchar* four_pixels(const Photo& photo, int x, int y, std::array<uchar, 16>& copy) {
  const cv::Mat3b& image = photo.image;
  const Projection& sensor = photo.camera.projection;
  const int v = std::clamp(y, 0, sensor.height - 1) - photo.first.y, u = x - photo.first.x;
  const bool is_held = v >= 0 && v < image.rows;
  if (is_held && u >= 0 && u + 6 <= image.cols) return image.ptr(v) + std::ptrdiff_t{3} * u;
  copy.fill(0);
  for (int i = 0; is_held && i < 4; ++i) {
    const int at = std::clamp(x + i, 0, sensor.width - 1) - photo.first.x;
    if (at < 0 || at >= image.cols) continue;
    std::memcpy(copy.data() + std::ptrdiff_t{3} * i, image.ptr(v) + std::ptrdiff_t{3} * at, 3);
  }
  return copy.data();
}

/// The four bytes at `from` as numbers.
FourLanes four_bytes(const uchar* from) {
  std::uint32_t word = 0;
  std::memcpy(&word, from, sizeof(word));
  // Step by step, as every processor has it: GCC makes worse of a conversion from four bytes.
  const auto bytes = reinterpret_cast<SixteenBytes>(FourWords{word, 0, 0, 0});
  const SixteenBytes zero = {};
  const auto shorts = reinterpret_cast<EightShorts>(
      __builtin_shufflevector(bytes, zero, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
  const auto ints = reinterpret_cast<FourInts>(
      __builtin_shufflevector(shorts, reinterpret_cast<EightShorts>(zero), 0, 8, 1, 9, 2, 10, 3, 11));
  return __builtin_convertvector(ints, FourLanes);
}

/// Whether a byte of the first twelve reaches `limit`.
bool reaches(const SixteenBytes& bytes, int limit) {
  if (limit > 255) return false;
  const auto is_reached = reinterpret_cast<TwoLongs>(bytes >= static_cast<std::uint8_t>(std::max(limit, 0)));
  return (is_reached[0] | (is_reached[1] & 0xFFFFFFFFU)) != 0;
}

}  // namespace

PhotoView::PhotoView(const Photo& photo, const Mesh& mesh, const TextureOptions& options, double typical)
    : photo_(&photo),
      distortion_(photo.camera),
      camera_from_model_(photo.camera.camera_from_turntable * photo.turntable_from_model),
      centre_(camera_from_model_.inverse().translation()),
      px_per_mm_at_1mm_(photo.camera.projection.fx / typical),
      cos_limit_(std::cos(to_radians(options.max_incidence_deg))),
      edge_px_(options.edge_px),
      edge_fade_px_(options.edge_fade_px),
      saturated_(options.saturated),
      seen_(draw_depth(mesh, photo.camera.projection, camera_from_model_)) {
  edge_px_away_ = cv::Mat1f(seen_.window.size(), 0.0F);
  if (seen_.window.empty()) return;
  cut_at_border();
  find_edges();
  if (!photo.in_front.empty()) hide_behind(photo.in_front);
}

/// The places lie a pixel or a few apart.
void PhotoView::hide_behind(const std::vector<Eigen::Vector3f>& in_front) {
  constexpr int kAroundPx = 4;
  cv::Mat1b kept(seen_.window.size(), uchar{255});
  for (const Eigen::Vector3f& place : in_front) {
    const Eigen::Vector3d p = camera_from_model_ * place.cast<double>();
    if (p.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = photo_->camera.projection.project(p);
    const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
    const cv::Rect around(at - seen_.window.tl() - cv::Point(kAroundPx, kAroundPx),
                          cv::Size(2 * kAroundPx + 1, 2 * kAroundPx + 1));
    kept(around & cv::Rect({0, 0}, kept.size())) = uchar{0};
  }
  fade_out_towards(kept);
}

/// What the photo's border cuts off ends in an edge, towards which colours fade out.
void PhotoView::cut_at_border() {
  const cv::Rect& window = seen_.window;
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      const Eigen::Vector2d pinhole(x + window.x, y + window.y);
      const bool is_seen = !std::isnan(seen_.depth(y, x));
      if (is_seen && !photo_->camera.projection.contains(distortion_.distorted(pinhole), 1.0)) {
        seen_.depth(y, x) = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
}

void PhotoView::find_edges() {
  const float mm_per_px_at_1mm = static_cast<float>(1.0 / photo_->camera.projection.fx);
  // Written so that NaN (no mesh) against a number is a step as well.
  const auto step = [&](float a, float b) { return !(std::abs(a - b) <= kStep * mm_per_px_at_1mm * std::min(a, b)); };
  const cv::Mat1f& depth = seen_.depth;
  cv::Mat1b inside(depth.size(), uchar{0});
  for (int y = 1; y + 1 < depth.rows; ++y) {
    for (int x = 1; x + 1 < depth.cols; ++x) {
      const float z = depth(y, x);
      const bool edge = std::isnan(z) || step(z, depth(y, x - 1)) || step(z, depth(y, x + 1)) ||
                        step(z, depth(y - 1, x)) || step(z, depth(y + 1, x));
      inside(y, x) = edge ? uchar{0} : uchar{255};
    }
  }
  cv::distanceTransform(inside, edge_px_away_, cv::DIST_L2, cv::DIST_MASK_5);
}

void PhotoView::leave_out(const cv::Mat1b& mask) {
  if (seen_.window.empty()) return;
  cv::Mat1b kept(seen_.window.size(), uchar{255});
  for (int y = 0; y < kept.rows; ++y) {
    for (int x = 0; x < kept.cols; ++x) {
      const Eigen::Vector2d pixel = distortion_.distorted({x + seen_.window.x, y + seen_.window.y});
      const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      if (at.inside({0, 0, mask.cols, mask.rows}) && mask(at) != 0) kept(y, x) = 0;
    }
  }
  fade_out_towards(kept);
}

void PhotoView::fade_out_towards(const cv::Mat1b& kept) {
  cv::Mat1f away;
  cv::distanceTransform(kept, away, cv::DIST_L2, cv::DIST_MASK_5);
  edge_px_away_ = cv::min(edge_px_away_, away);
}

std::optional<Sight> PhotoView::look(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
  if (normal.dot(centre_ - point) <= 0.0) return std::nullopt;  // most photos, without a square root
  const double cosine = normal.dot(towards(point));
  if (cosine <= cos_limit_) return std::nullopt;
  const Eigen::Vector3d in_camera = camera_from_model_ * point;
  const double z = in_camera.z();
  if (z <= 0.0) return std::nullopt;
  const Eigen::Vector2d pinhole = photo_->camera.projection.project(in_camera);
  const double x = pinhole.x() - seen_.window.x;
  const double y = pinhole.y() - seen_.window.y;
  if (!(x >= 1.0 && y >= 1.0 && x < seen_.window.width - 2 && y < seen_.window.height - 2)) return std::nullopt;

  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const double fx = x - ix;
  const double fy = y - iy;
  const double nearest = seen_.depth(iy + (fy >= 0.5 ? 1 : 0), ix + (fx >= 0.5 ? 1 : 0));
  // NaN (no mesh there) fails the comparison.
  if (!(z <= nearest + kSlack * z / photo_->camera.projection.fx)) return std::nullopt;

  const double away = (1 - fy) * ((1 - fx) * edge_px_away_(iy, ix) + fx * edge_px_away_(iy, ix + 1)) +
                      fy * ((1 - fx) * edge_px_away_(iy + 1, ix) + fx * edge_px_away_(iy + 1, ix + 1));
  const double fade = std::min(1.0, (away - edge_px_) / edge_fade_px_);
  if (fade <= 0.0) return std::nullopt;

  const Eigen::Vector2d pixel = distortion_.distorted(pinhole);
  if (!photo_->camera.projection.contains(pixel, 1.0)) return std::nullopt;
  const double beyond = (cosine - cos_limit_) / (1.0 - cos_limit_);
  const double quality = beyond * beyond * px_per_mm_at_1mm_ / z;
  return Sight{pixel, fade * fade * quality};
}

std::optional<Eigen::Vector2d> PhotoView::pixel_of(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d in_camera = camera_from_model_ * point;
  if (in_camera.z() <= 0.0) return std::nullopt;
  return distortion_.distorted(photo_->camera.projection.project(in_camera));
}

Sample PhotoView::sample(const Eigen::Vector2f& pixel) const {
  const int x = rounded_down(pixel.x()), y = rounded_down(pixel.y());
  const auto across = cubic(pixel.x() - static_cast<float>(x));
  const auto down = cubic(pixel.y() - static_cast<float>(y));
  FourLanes sum = {};
  SixteenBytes highest = {};
  std::array<uchar, 16> copy{};
  for (int j = 0; j < 4; ++j) {
    const uchar* four = four_pixels(*photo_, x - 1, y - 1 + j, copy);
    FourLanes line = {};
    for (std::size_t i = 0; i < 4; ++i) line += across[i] * four_bytes(four + 3 * i);
    sum += down[static_cast<std::size_t>(j)] * line;
    SixteenBytes bytes;
    std::memcpy(&bytes, four, sizeof(bytes));
    highest = bytes > highest ? bytes : highest;
  }
  return {Eigen::Vector3f(sum[0], sum[1], sum[2]).cwiseMax(0.0F) / 255.0F, reaches(highest, saturated_)};
}

double typical_px_per_mm(const Mesh& mesh, std::span<const Photo> photos) {
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(v);
  std::vector<double> found;
  for (const Photo& photo : photos) {
    const double z =
        (photo.camera.camera_from_turntable * (photo.turntable_from_model * box.center().cast<double>())).z();
    if (z > 0.0) found.push_back(photo.camera.projection.fx / z);
  }
  if (found.empty()) return 1.0;
  std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2), found.end());
  return found[found.size() / 2];
}

}  // namespace scanrig
