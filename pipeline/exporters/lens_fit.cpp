#include "pipeline/exporters/lens_fit.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace scanrig {
namespace {

constexpr int kAcross = 41, kDown = 31;  ///< points over the image
constexpr double kWorthIt = 0.98;        ///< of the rms: what more coefficients must reach
constexpr std::size_t kIntrinsics = 4;   ///< fx fy cx cy
constexpr double kSmallPx = 0.01;        ///< residual that a coefficient of the size of its scale costs
constexpr int kMaxRounds = 60;
// How large a coefficient gets without being odd; one that hardly acts stays near its start.
constexpr std::array<double, 14> kScale{0.3, 2.0, 2e-3, 2e-3, 2.0, 0.3, 2.0, 2.0, 2e-3, 2e-3, 2e-3, 2e-3, 5e-3, 5e-3};

/// A direction and the pixel that shows it.
struct Ray {
  Eigen::Vector3d direction;
  Eigen::Vector2d pixel;
};

std::vector<Ray> rays_of(const Camera& camera) {
  std::vector<Ray> rays;
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      const Eigen::Vector2d pixel(i * (camera.projection.width - 1.0) / (kAcross - 1),
                                  j * (camera.projection.height - 1.0) / (kDown - 1));
      rays.push_back({camera.ray(pixel), pixel});
    }
  }
  return rays;
}

OpenCvLens brown_of(const Camera& camera) {
  const Projection& p = camera.projection;
  OpenCvLens lens{.fx = p.fx, .fy = p.fy, .cx = p.cx, .cy = p.cy};
  for (std::size_t i = 0; i < camera.distortion.size(); ++i) lens.distortion[i] = camera.distortion[i];
  return lens;
}

Eigen::VectorXd values_of(const OpenCvLens& lens) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(kIntrinsics + lens.count));
  values.head<4>() << lens.fx, lens.fy, lens.cx, lens.cy;
  for (std::size_t i = 0; i < lens.count; ++i) values[static_cast<Eigen::Index>(kIntrinsics + i)] = lens.distortion[i];
  return values;
}

OpenCvLens lens_of(const Eigen::VectorXd& values) {
  OpenCvLens lens{.fx = values[0], .fy = values[1], .cx = values[2], .cy = values[3]};
  lens.count = static_cast<std::size_t>(values.size()) - kIntrinsics;
  for (std::size_t i = 0; i < lens.count; ++i) lens.distortion[i] = values[static_cast<Eigen::Index>(kIntrinsics + i)];
  return lens;
}

/// Of how far a value changes to be felt: pixels for the intrinsics.
double scale_of(Eigen::Index value) {
  const auto at = static_cast<std::size_t>(value);
  return at < kIntrinsics ? 1.0 : kScale[at - kIntrinsics];
}

/// Model minus pixel of every ray, then how far each coefficient is from its start.
Eigen::VectorXd misses_of(const std::vector<Ray>& rays, const Eigen::VectorXd& values, const Eigen::VectorXd& start) {
  const OpenCvLens lens = lens_of(values);
  const auto rows = 2 * static_cast<Eigen::Index>(rays.size());
  const auto count = static_cast<Eigen::Index>(lens.count);
  Eigen::VectorXd misses(rows + count);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    misses.segment<2>(2 * static_cast<Eigen::Index>(i)) = lens.project(rays[i].direction) - rays[i].pixel;
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index at = static_cast<Eigen::Index>(kIntrinsics) + i;
    misses[rows + i] = kSmallPx * (values[at] - start[at]) / scale_of(at);
  }
  return misses;
}

/// Levenberg and Marquardt; derivatives by central differences.
OpenCvLens fitted(const std::vector<Ray>& rays, const OpenCvLens& from) {
  const Eigen::VectorXd start = values_of(from);
  Eigen::VectorXd values = start, misses = misses_of(rays, values, start);
  double damping = 1e-6;
  for (int round = 0; round < kMaxRounds; ++round) {
    Eigen::MatrixXd jacobian(misses.size(), values.size());  // by values over their scales
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const double step = 1e-4 * scale_of(i);
      Eigen::VectorXd up = values, down = values;
      up[i] += step;
      down[i] -= step;
      jacobian.col(i) = (misses_of(rays, up, start) - misses_of(rays, down, start)) / 2e-4;
    }
    Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
    normal.diagonal() *= 1.0 + damping;
    Eigen::VectorXd next = values - normal.ldlt().solve(jacobian.transpose() * misses);
    for (Eigen::Index i = 0; i < values.size(); ++i) next[i] = values[i] + (next[i] - values[i]) * scale_of(i);
    const Eigen::VectorXd left = misses_of(rays, next, start);
    const double gain = 1.0 - left.squaredNorm() / misses.squaredNorm();
    if (!(gain > 0.0)) {
      damping *= 10.0;
      if (damping > 1e6) break;
      continue;
    }
    values = next;
    misses = left;
    damping = std::max(1e-12, 0.1 * damping);
    if (gain < 1e-10) break;
  }
  return lens_of(values);
}

LensFit measured(const std::vector<Ray>& rays, const OpenCvLens& lens) {
  LensFit fit{.lens = lens};
  double sum = 0.0;
  for (const Ray& ray : rays) {
    const double miss = (lens.project(ray.direction) - ray.pixel).norm();
    sum += miss * miss;
    fit.max_px = std::max(fit.max_px, miss);
  }
  fit.rms_px = std::sqrt(sum / static_cast<double>(rays.size()));
  return fit;
}

/// Plane of the image tilted against the lens by `tau_x` and `tau_y`, rad, as in OpenCV.
Eigen::Vector2d tilted(const Eigen::Vector2d& p, double tau_x, double tau_y) {
  if (tau_x == 0.0 && tau_y == 0.0) return p;
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(-tau_y, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(-tau_x, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  Eigen::Matrix3d onto = Eigen::Matrix3d::Identity();
  onto(0, 0) = onto(1, 1) = turn(2, 2);
  onto(0, 2) = -turn(0, 2);
  onto(1, 2) = -turn(1, 2);
  return (onto * turn * p.homogeneous()).hnormalized();
}

}  // namespace

Eigen::Vector2d OpenCvLens::project(const Eigen::Vector3d& point) const {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y] = distortion;
  const double x = point.x() / point.z(), y = point.y() / point.z(), r2 = x * x + y * y;
  const double radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  const Eigen::Vector2d bent(x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
                             y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4));
  const Eigen::Vector2d on_sensor = tilted(bent, tau_x, tau_y);
  return {fx * on_sensor.x() + cx, fy * on_sensor.y() + cy};
}

LensFit fit_lens(const Camera& camera, std::span<const std::size_t> counts) {
  OpenCvLens lens = brown_of(camera);
  if (!camera.lens_field) return {.lens = lens};
  const std::vector<Ray> rays = rays_of(camera);
  LensFit best = measured(rays, lens);
  for (const std::size_t count : counts) {
    lens.count = count;
    const LensFit fit = measured(rays, fitted(rays, lens));
    if (fit.rms_px < kWorthIt * best.rms_px) best = fit;
  }
  return best;
}

}  // namespace scanrig
