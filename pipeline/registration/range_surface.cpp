#include "pipeline/registration/range_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr double kMinSigma = 0.003;  // mm; no camera measures better, and weights stay finite
constexpr double kMaxSlope = 6.0;    // depth change per pixel, in pixel footprints, that is still one surface
constexpr double kMinFacing = 0.2;   // cosine of the most grazing incidence that is used
constexpr double kMinUnity = 0.95;   // length of the mean of four normals; less is an edge, not a plane
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Eigen::Vector3d to_eigen(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

/// Unit vector from the camera to a point of its frame.
Eigen::Vector3d ray_to(const Projection& projection, const Eigen::Vector3d& p) {
  if (projection.kind == Projection::Kind::orthographic) return Eigen::Vector3d::UnitZ();
  return p.normalized();
}

double sigma_along_normal(float sigma, const Eigen::Vector3d& normal) {
  const double known = std::isnan(sigma) ? 0.0 : sigma;
  return std::max(known * std::abs(normal.z()), kMinSigma);
}

/// Depth at `pixel` of the plane through `p` with `normal`.
double depth_on_plane(const Projection& projection, const Eigen::Vector2d& pixel, const Eigen::Vector3d& p,
                      const Eigen::Vector3d& normal) {
  const Eigen::Vector3d q = projection.unproject(pixel.x(), pixel.y(), p.z());
  if (projection.kind == Projection::Kind::orthographic) return p.z() + normal.dot(p - q) / normal.z();
  return p.z() * normal.dot(p) / normal.dot(q);
}

/// The rays of a pixel and of the four grid points around it, and where the first meets their planes.
class CornerRays {
 public:
  CornerRays(const Projection& projection, const Eigen::Vector2d& pixel, int column, int row)
      : is_pinhole_(projection.kind == Projection::Kind::pinhole) {
    const Eigen::Vector2d scale(1.0 / projection.fx, 1.0 / projection.fy), centre(projection.cx, projection.cy);
    ray_ = (pixel - centre).cwiseProduct(scale);
    const Eigen::Vector2d low = (Eigen::Vector2d(column, row) - centre).cwiseProduct(scale);
    corner_ = {low, {low.x() + scale.x(), low.y()}, {low.x(), low.y() + scale.y()}, low + scale};
  }
  /// Of the plane through corner `k` at `depth`, under the pixel.
  [[nodiscard]] double depth_on_plane(int k, double depth, const Eigen::Vector3d& normal) const {
    const Eigen::Vector2d& corner = corner_[static_cast<std::size_t>(k)];
    const auto flat = normal.head<2>();
    if (!is_pinhole_) return depth + flat.dot(corner - ray_) / normal.z();
    return depth * (flat.dot(corner) + normal.z()) / (flat.dot(ray_) + normal.z());
  }

 private:
  bool is_pinhole_;
  Eigen::Vector2d ray_;
  std::array<Eigen::Vector2d, 4> corner_;
};

std::optional<SurfacePoint> surface_point(const RangeImage& image, int row, int column) {
  const float depth = image.depth(row, column);
  const cv::Vec3f& n = image.normal(row, column);
  if (std::isnan(depth) || std::isnan(n[0])) return std::nullopt;
  SurfacePoint s;
  s.point = image.projection.unproject(column, row, depth);
  s.normal = to_eigen(n);
  s.facing = -s.normal.dot(ray_to(image.projection, s.point));
  if (s.facing < kMinFacing) return std::nullopt;
  s.sigma = sigma_along_normal(image.sigma(row, column), s.normal);
  return s;
}

void average_block(const RangeImage& fine, int row, int column, RangeImage& coarse) {
  float nearest = std::numeric_limits<float>::infinity();
  for (int k = 0; k < 4; ++k) nearest = std::fmin(nearest, fine.depth(2 * row + k / 2, 2 * column + k % 2));
  const double limit = nearest + kMaxSlope * fine.projection.mm_per_pixel(nearest);
  double depth = 0.0;
  double sigma = 0.0;
  cv::Vec3f normal(0, 0, 0);
  int count = 0;
  for (int k = 0; k < 4; ++k) {
    const int r = 2 * row + k / 2;
    const int c = 2 * column + k % 2;
    if (!(fine.depth(r, c) <= limit) || std::isnan(fine.normal(r, c)[0])) continue;
    // The depth its plane has in the block's middle: at a rim the known pixels are not around the middle.
    depth += depth_on_plane(fine.projection, {2 * column + 0.5, 2 * row + 0.5},
                            fine.projection.unproject(c, r, fine.depth(r, c)), to_eigen(fine.normal(r, c)));
    sigma += fine.sigma(r, c);  // not divided by sqrt(count): neighbours share a matching window
    normal += fine.normal(r, c);
    ++count;
  }
  const double length = cv::norm(normal);
  if (count < 2 || length < 0.5 * count) return;
  coarse.depth(row, column) = static_cast<float>(depth / count);
  coarse.sigma(row, column) = static_cast<float>(sigma / count);
  coarse.normal(row, column) = normal * static_cast<float>(1.0 / length);
}

RangeImage halved(const RangeImage& fine) {
  RangeImage coarse;
  coarse.projection = fine.projection;
  Projection& p = coarse.projection;
  p.width /= 2;
  p.height /= 2;
  p.fx /= 2;
  p.fy /= 2;
  p.cx = (p.cx - 0.5) / 2;
  p.cy = (p.cy - 0.5) / 2;
  p.crop_x /= 2;
  p.crop_y /= 2;
  p.sensor_width /= 2;
  p.sensor_height /= 2;
  coarse.camera_from_pose = fine.camera_from_pose;
  coarse.depth = cv::Mat1f(p.height, p.width, kNaN);
  coarse.sigma = cv::Mat1f(p.height, p.width, kNaN);
  coarse.normal = cv::Mat3f(p.height, p.width, cv::Vec3f(kNaN, kNaN, kNaN));
  for (int row = 0; row < p.height; ++row) {
    for (int column = 0; column < p.width; ++column) average_block(fine, row, column, coarse);
  }
  return coarse;
}

/// The first pixel of those that lie `stride` apart on the sensor, counted from `from`; `offset` were cropped off.
int first_of_grid(int from, int stride, int offset) { return (((from - offset) % stride) + stride) % stride; }

}  // namespace

std::vector<RangeLevel> range_pyramid(std::span<const View> views, int levels) {
  std::vector<RangeLevel> pyramid(levels, RangeLevel(views.size()));
  parallel_for(views.size(), [&](std::size_t v) {
    pyramid[0][v] = views[v].range;
    for (int level = 1; level < levels; ++level) pyramid[level][v] = halved(pyramid[level - 1][v]);
  });
  return pyramid;
}

std::optional<SurfacePoint> surface_at(const RangeImage& image, const Eigen::Vector2d& pixel) {
  if (!image.projection.contains(pixel)) return std::nullopt;
  const int column = std::min(static_cast<int>(pixel.x()), image.projection.width - 2);
  const int row = std::min(static_cast<int>(pixel.y()), image.projection.height - 2);
  const float* depth[2] = {image.depth[row] + column, image.depth[row + 1] + column};
  const float lowest = std::min({depth[0][0], depth[0][1], depth[1][0], depth[1][1]});
  const float highest = std::max({depth[0][0], depth[0][1], depth[1][0], depth[1][1]});
  if (std::isnan(depth[0][0] + depth[0][1] + depth[1][0] + depth[1][1])) return std::nullopt;
  const double footprint = image.projection.mm_per_pixel(lowest);
  if (highest - lowest > kMaxSlope * footprint) return std::nullopt;
  const double u = pixel.x() - column;
  const double v = pixel.y() - row;
  const double weight[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
  const CornerRays rays(image.projection, pixel, column, row);
  double chord = 0.0;
  double tangent = 0.0;
  double sigma = 0.0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const double d = static_cast<double>(depth[k / 2][k % 2]);
    const Eigen::Vector3d n = to_eigen(image.normal(row + k / 2, column + k % 2));
    chord += weight[k] * d;
    tangent += weight[k] * rays.depth_on_plane(k, d, n);
    sigma += weight[k] * static_cast<double>(image.sigma(row + k / 2, column + k % 2));
    normal += weight[k] * n;
  }
  if (!(std::abs(chord - tangent) < footprint)) return std::nullopt;
  SurfacePoint s;
  // Chords fall inside a curved surface by as much as tangent planes stand outside it.
  s.point = image.projection.unproject(pixel.x(), pixel.y(), 0.5 * (chord + tangent));
  const double length = normal.norm();
  if (!(length > kMinUnity)) return std::nullopt;
  s.normal = normal / length;
  s.facing = -s.normal.dot(ray_to(image.projection, s.point));
  s.sigma = sigma_along_normal(static_cast<float>(sigma), s.normal);
  return s;
}

std::optional<SurfacePoint> tangent_plane_near(const RangeImage& image, const Eigen::Vector3d& p) {
  constexpr int kSteps = 5;
  Eigen::Vector3d foot = p;
  for (int step = 0;; ++step) {
    if (image.projection.kind == Projection::Kind::pinhole && foot.z() <= 0.0) return std::nullopt;
    const auto hit = surface_at(image, image.projection.project(foot));
    if (!hit) return std::nullopt;
    const Eigen::Vector3d next = p + hit->normal * hit->normal.dot(hit->point - p);
    const double moved = (next - foot).norm() / image.projection.mm_per_pixel(hit->point.z());
    if (moved < 0.1 || (step == kSteps && moved < 1.5)) return hit;
    if (step == kSteps) return std::nullopt;
    foot = next;
  }
}

std::vector<SurfacePoint> sample_image(const RangeImage& image, int count) {
  const double known = cv::countNonZero(image.depth == image.depth);  // NaN differs from itself
  const int stride = std::max(1, static_cast<int>(std::lround(std::sqrt(known / std::max(count, 1)))));
  std::vector<SurfacePoint> samples;
  const int first_row = first_of_grid(stride / 2, stride, image.projection.crop_y);
  const int first_column = first_of_grid(stride / 2, stride, image.projection.crop_x);
  for (int row = first_row; row < image.depth.rows; row += stride) {
    for (int column = first_column; column < image.depth.cols; column += stride) {
      if (const auto s = surface_point(image, row, column)) samples.push_back(*s);
    }
  }
  return samples;
}

std::vector<SurfacePoint> sample_surface(const RangeLevel& images, double spacing_mm) {
  struct Candidate {
    std::uint64_t cube;
    SurfacePoint point;
  };
  std::vector<std::vector<Candidate>> found(images.size());
  parallel_for(images.size(), [&](std::size_t v) {
    const RangeImage& image = images[v];
    const Transform pose_from_camera = image.camera_from_pose.inverse();
    int stride = 0;  // set at the first measured pixel: two candidates along a cube's edge
    for (int row = 0; row < image.depth.rows; row += std::max(stride, 1)) {
      const int first_column = stride > 0 ? first_of_grid(0, stride, image.projection.crop_x) : 0;
      for (int column = first_column; column < image.depth.cols; column += std::max(stride, 1)) {
        const auto s = surface_point(image, row, column);
        if (!s) continue;
        if (stride == 0) {
          stride = std::max(1, static_cast<int>(0.5 * spacing_mm / image.projection.mm_per_pixel(s->point.z())));
        }
        Candidate c;
        c.point = {pose_from_camera * s->point, pose_from_camera.linear() * s->normal, s->sigma, s->facing,
                   static_cast<int>(v)};
        c.cube = 0;
        for (int axis = 0; axis < 3; ++axis) {
          const auto cell = std::llround(c.point.point[axis] / spacing_mm) + (1 << 20);
          c.cube = (c.cube << 21) | (static_cast<std::uint64_t>(cell) & 0x1FFFFF);
        }
        found[v].push_back(c);
      }
    }
  });
  std::vector<Candidate> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  std::stable_sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
    return a.cube != b.cube ? a.cube < b.cube : a.point.facing > b.point.facing;
  });
  std::vector<SurfacePoint> samples;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i == 0 || all[i].cube != all[i - 1].cube) samples.push_back(all[i].point);
  }
  return samples;
}

double measured_size(const RangeLevel& images) {
  Eigen::AlignedBox3d box;
  for (const RangeImage& image : images) {
    const Transform pose_from_camera = image.camera_from_pose.inverse();
    for (const SurfacePoint& s : sample_image(image, 2000)) box.extend(pose_from_camera * s.point);
  }
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

}  // namespace scanrig
