#include "tests/unit/pipeline/range/two_cameras.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig::test {
namespace {

double hashed(std::int64_t x, std::int64_t y, std::uint64_t salt) {
  std::uint64_t h = std::uint64_t(x) * 0x9E3779B97F4A7C15ull ^ std::uint64_t(y) * 0xC2B2AE3D27D4EB4Full ^
                    salt * 0x165667B19E3779F9ull;
  h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9ull;
  h = (h ^ (h >> 27)) * 0x94D049BB133111EBull;
  return static_cast<double>((h ^ (h >> 31)) >> 11) / 9007199254740992.0;
}

/// Gaussian dots, one per cell of 0.5 mm (at 640 mm), anywhere in it; 0..1.
double dots(double x, double y) {
  constexpr double kCell = 0.5, kSigma = 0.17;
  const std::int64_t i = std::int64_t(std::floor(x / kCell)), j = std::int64_t(std::floor(y / kCell));
  double light = 0.0;
  for (std::int64_t b = j - 1; b <= j + 1; ++b) {
    for (std::int64_t a = i - 1; a <= i + 1; ++a) {
      if (hashed(a, b, 3) < 0.4) continue;
      const double dx = x - (double(a) + hashed(a, b, 1)) * kCell, dy = y - (double(b) + hashed(a, b, 2)) * kCell;
      light += std::exp(-(dx * dx + dy * dy) / (2.0 * kSigma * kSigma));
    }
  }
  return std::min(light, 1.3);
}

Camera looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at, cv::Size size) {
  Camera camera;
  camera.projection = {Projection::Kind::pinhole, size.width, size.height, 4266.7, 4266.7, (size.width - 1) / 2.0,
                       (size.height - 1) / 2.0};
  const Eigen::Vector3d z = (at - from).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d axes;
  axes.row(0) = x;
  axes.row(1) = z.cross(x);
  axes.row(2) = z;
  camera.camera_from_turntable.linear() = axes;
  camera.camera_from_turntable.translation() = -(axes * from);
  return camera;
}

const Eigen::Vector3d kAim(0, 45, 0);

Eigen::Vector3d rig_centre() {
  return kAim + 640.0 * Eigen::Vector3d(0, std::sin(to_radians(22.0)), std::cos(to_radians(22.0)));
}

}  // namespace

Surface ball(const Eigen::Vector3d& centre, double radius) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) -> std::optional<double> {
    const Eigen::Vector3d to = centre - origin;
    const double along = to.dot(direction);
    const double inside = radius * radius - (to - along * direction).squaredNorm();
    if (inside < 0.0) return std::nullopt;
    return along - std::sqrt(inside);
  };
}

Surface disc(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double radius) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) -> std::optional<double> {
    const double t = normal.dot(centre - origin) / normal.dot(direction);
    if (!(t > 0.0) || (origin + t * direction - centre).norm() > radius) return std::nullopt;
    return t;
  };
}

Surface strip(const Eigen::Vector3d& centre, double width, double height) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) -> std::optional<double> {
    const double t = (centre.z() - origin.z()) / direction.z();
    const Eigen::Vector3d off = origin + t * direction - centre;
    if (!(t > 0.0) || std::abs(off.x()) > width / 2 || std::abs(off.y()) > height / 2) return std::nullopt;
    return t;
  };
}

Surface cylinder(double x, double z, double radius) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) -> std::optional<double> {
    const Eigen::Vector2d from(origin.x() - x, origin.z() - z), along(direction.x(), direction.z());
    const double a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - radius * radius;
    if (b * b < a * c) return std::nullopt;
    return (-b - std::sqrt(b * b - a * c)) / a;
  };
}

Surface nearest_of(const Surface& a, const Surface& b) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    const auto first = a(origin, direction), second = b(origin, direction);
    if (!first || !second) return first ? first : second;
    return std::optional<double>(std::min(*first, *second));
  };
}

Calibration default_rig(cv::Size size) {
  Calibration calibration;
  calibration.left = looking(rig_centre() - Eigen::Vector3d(80, 0, 0), kAim, size);
  calibration.right = looking(rig_centre() + Eigen::Vector3d(80, 0, 0), kAim, size);
  calibration.table_radius_mm = 90.0;
  return calibration;
}

cv::Mat3b render(const Camera& camera, const Surface& surface, const Look& look) {
  const Projection& p = camera.projection;
  const Transform turntable_from_camera = camera.camera_from_turntable.inverse();
  const Camera projector = looking(rig_centre() + Eigen::Vector3d(0, 85, 0), kAim, {1, 1});
  cv::Mat3b image(p.height, p.width);
  parallel_for(std::size_t(p.height), [&](std::size_t row) {
    std::mt19937_64 random(look.seed * 7919u + row);
    std::normal_distribution<double> noise(0.0, look.noise);
    const int v = static_cast<int>(row);
    for (int u = 0; u < p.width; ++u) {
      Eigen::Vector3d colour = Eigen::Vector3d::Zero();
      for (const double b : {-0.25, 0.25}) {
        for (const double a : {-0.25, 0.25}) {
          const Eigen::Vector3d direction =
              (turntable_from_camera.linear() * p.unproject(u + a, v + b, 1.0)).normalized();
          const Eigen::Vector3d origin = turntable_from_camera.translation();
          const auto distance = surface(origin, direction);
          if (!distance) {
            colour += look.screen / 4;
            continue;
          }
          const Eigen::Vector3d lit = projector.camera_from_turntable * Eigen::Vector3d(origin + *distance * direction);
          const double dot = look.dots ? dots(640.0 * lit.x() / lit.z(), 640.0 * lit.y() / lit.z()) : 0.0;
          const double light = look.dots ? look.room_light + look.dot_light * dot : 1.0;
          colour += look.object * light / 4;
        }
      }
      for (int c = 0; c < 3; ++c) image(v, u)[c] = cv::saturate_cast<std::uint8_t>(colour[c] + noise(random));
    }
  });
  return image;
}

cv::Mat1f true_depth(const Projection& projection, const Transform& frame_from_turntable, const Surface& surface) {
  cv::Mat1f depth(projection.height, projection.width, std::numeric_limits<float>::quiet_NaN());
  const Transform turntable_from_frame = frame_from_turntable.inverse();
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const Eigen::Vector3d ray = projection.unproject(u, v, 1.0);
      const auto t = surface(turntable_from_frame.translation(), (turntable_from_frame.linear() * ray).normalized());
      if (t) depth(v, u) = static_cast<float>(*t / ray.norm());
    }
  }
  return depth;
}

}  // namespace scanrig::test
