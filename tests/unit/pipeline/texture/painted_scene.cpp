#include "tests/unit/pipeline/texture/painted_scene.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "core/parallel.h"

namespace scanrig::testing {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRays = 3;

std::optional<double> hit(const Ball& ball, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d to = origin - ball.centre;
  const double b = to.dot(direction);
  const double root = b * b - to.squaredNorm() + ball.radius * ball.radius;
  if (root < 0.0) return std::nullopt;
  return -b - std::sqrt(root);
}

void add_ball(const Ball& ball, double edge, Mesh& mesh) {
  const int rings = std::max(4, static_cast<int>(kPi * ball.radius / edge));
  const int around = 2 * rings;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto add = [&](double polar, double azimuth) {
    const Eigen::Vector3d n(std::sin(polar) * std::sin(azimuth), std::cos(polar), std::sin(polar) * std::cos(azimuth));
    mesh.vertices.push_back((ball.centre + ball.radius * n).cast<float>());
  };
  add(0.0, 0.0);
  for (int r = 1; r < rings; ++r) {
    for (int a = 0; a < around; ++a) add(kPi * r / rings, 2.0 * kPi * a / around);
  }
  add(kPi, 0.0);
  const auto at = [&](int r, int a) {
    if (r == 0) return first;
    if (r == rings) return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    return first + 1 + static_cast<std::uint32_t>((r - 1) * around + a % around);
  };
  for (int r = 0; r < rings; ++r) {
    for (int a = 0; a < around; ++a) {
      if (r > 0) mesh.faces.push_back({at(r, a), at(r + 1, a), at(r, a + 1)});
      if (r + 1 < rings) mesh.faces.push_back({at(r, a + 1), at(r + 1, a), at(r + 1, a + 1)});
    }
  }
}

/// Directions of all rays of an image with z = 1, camera frame.
std::vector<cv::Point2d> rays_of(const Camera& camera) {
  const Projection& p = camera.projection;
  std::vector<cv::Point2d> pixels, rays;
  for (int y = 0; y < p.height * kRays; ++y) {
    for (int x = 0; x < p.width * kRays; ++x) pixels.emplace_back((x + 0.5) / kRays - 0.5, (y + 0.5) / kRays - 0.5);
  }
  const cv::Matx33d matrix(p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1);
  const std::vector<double> distortion(camera.distortion.begin(), camera.distortion.end());
  cv::undistortPoints(pixels, rays, matrix, distortion, cv::noArray(), cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 1e-7));
  return rays;
}

}  // namespace

Mesh PaintedScene::mesh(double edge) const {
  Mesh mesh;
  for (const Ball& ball : balls) add_ball(ball, edge, mesh);
  return mesh;
}

Photo PaintedScene::photo(const Camera& camera, double angle_rad) const {
  return std::move(photos(camera, {angle_rad}).front());
}

std::vector<Photo> PaintedScene::photos(const Camera& camera, const std::vector<double>& angles_rad) const {
  const auto rays = rays_of(camera);
  std::vector<Photo> taken;
  for (const double angle : angles_rad) taken.push_back(expose(camera, angle, rays));
  return taken;
}

Photo PaintedScene::expose(const Camera& camera, double angle_rad, const std::vector<cv::Point2d>& rays) const {
  Photo photo{camera, rot_y(angle_rad), cv::Mat3b(camera.projection.height, camera.projection.width)};
  const Transform model_from_camera = (camera.camera_from_turntable * photo.turntable_from_model).inverse();
  const Eigen::Vector3d backdrop(0.8, 0.1, 0.1);
  parallel_for(static_cast<std::size_t>(photo.image.rows), [&](std::size_t y) {
    for (int x = 0; x < photo.image.cols; ++x) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int k = 0; k < kRays * kRays; ++k) {
        const auto row = y * kRays + static_cast<std::size_t>(k / kRays);
        const cv::Point2d& ray = rays[row * static_cast<std::size_t>(photo.image.cols * kRays) +
                                      static_cast<std::size_t>(x * kRays + k % kRays)];
        const Eigen::Vector3d direction =
            (model_from_camera.linear() * Eigen::Vector3d(ray.x, ray.y, 1.0)).normalized();
        double nearest = std::numeric_limits<double>::infinity();
        Eigen::Vector3d colour = backdrop;
        for (std::size_t i = 0; i < balls.size(); ++i) {
          const auto distance = hit(balls[i], model_from_camera.translation(), direction);
          if (!distance || *distance >= nearest) continue;
          nearest = *distance;
          const Eigen::Vector3d point = model_from_camera.translation() + nearest * direction;
          const Eigen::Vector3d normal = (point - balls[i].centre) / balls[i].radius;
          colour = paint(i, point) * lamps(photo.turntable_from_model.linear() * normal);
        }
        sum += colour / (kRays * kRays);
      }
      for (int c = 0; c < 3; ++c) {
        photo.image(static_cast<int>(y), x)[c] = cv::saturate_cast<uchar>(255.0 * sum[c]);
      }
    }
  });
  return photo;
}

Camera rig_camera(double azimuth_rad, double elevation_rad, double image_scale) {
  const Eigen::Vector3d aim(0.0, 45.0, 0.0);
  const Eigen::Vector3d away(std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad),
                             std::cos(elevation_rad) * std::cos(azimuth_rad));
  const Eigen::Vector3d z = -away;
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Camera camera;
  camera.projection = {Projection::Kind::pinhole,
                       static_cast<int>(1280 * image_scale),
                       static_cast<int>(960 * image_scale),
                       4266.7 * image_scale,
                       4266.7 * image_scale,
                       640.0 * image_scale + 3.2,
                       480.0 * image_scale - 2.7};
  // Strong enough that leaving any of it out moves the corners by pixels.
  camera.distortion = {-0.35, 0.2, 0.002, -0.0015, 0.0};
  camera.camera_from_turntable.linear() << x.transpose(), z.cross(x).transpose(), z.transpose();
  camera.camera_from_turntable.translation() = -camera.camera_from_turntable.linear() * (aim + 640.0 * away);
  return camera;
}

Eigen::Vector3d striped(const Eigen::Vector3d& p) {
  const double coarse = std::sin(2.0 * kPi * p.y() / 17.0 + 0.05 * p.x()) * std::sin(2.0 * kPi * p.x() / 13.0);
  const double fine = std::sin(2.0 * kPi * (p.x() + p.y()) / 4.1) * std::sin(2.0 * kPi * (p.z() - 0.3 * p.y()) / 3.0);
  return {0.4 + 0.15 * coarse + 0.08 * fine, 0.4 - 0.12 * coarse + 0.1 * fine,
          0.4 + 0.1 * std::sin(2.0 * kPi * p.z() / 9.0) + 0.08 * fine};
}

std::vector<double> turns(int count) {
  std::vector<double> angles;
  for (int k = 0; k < count; ++k) angles.push_back(2.0 * kPi * k / count);
  return angles;
}

}  // namespace scanrig::testing
