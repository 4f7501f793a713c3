#include "tests/unit/pipeline/volume/analytic_rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kStandOff = 640.0;  // mm from the camera to the point it looks at
const Eigen::Vector3d kTarget(0.0, 45.0, 0.0);

Transform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rows;
  rows << x.transpose(), z.cross(x).transpose(), z.transpose();
  Transform result = Transform::Identity();
  result.linear() = rows;
  result.translation() = -rows * eye;
  return result;
}

Eigen::Vector3d eye_at(const Rig& rig, double sideways_mm, double up_mm) {
  const double e = to_radians(rig.elevation_deg);
  return kTarget + kStandOff * Eigen::Vector3d(0.0, std::sin(e), std::cos(e)) +
         Eigen::Vector3d(sideways_mm, up_mm, 0.0);
}

Projection projection_of(const Rig& rig) {
  const double f = kStandOff / rig.mm_per_pixel;
  return {Projection::Kind::pinhole, rig.width, rig.height, f, f, 0.5 * (rig.width - 1), 0.5 * (rig.height - 1)};
}

bool sees(const Cast& cast, const Eigen::Vector3d& eye, const Hit& hit, const Eigen::Vector3d& point,
          double max_incidence_deg) {
  const Eigen::Vector3d to_eye = (eye - point).normalized();
  if (hit.normal.dot(to_eye) < std::cos(to_radians(max_incidence_deg))) return false;
  return !cast(point + 0.02 * hit.normal, to_eye).has_value();
}

/// One ray per pixel, nine where a neighbour differs.
Silhouette take_silhouette(const Rig& rig, const Cast& cast, const Transform& camera_from_pose) {
  constexpr int kFiner = 3;  // sub-pixels a side
  Silhouette result{projection_of(rig), camera_from_pose, {}};
  const Transform pose_from_camera = camera_from_pose.inverse();
  const auto misses = [&](double u, double v) {
    const Eigen::Vector3d ray = pose_from_camera.linear() * result.projection.unproject(u, v, 1.0).normalized();
    return cast(pose_from_camera.translation(), ray) ? uchar{0} : uchar{255};
  };
  cv::Mat1b coarse(rig.height, rig.width), low, high;
  const auto by_rows = [&](const auto& body) {
    parallel_for(static_cast<std::size_t>(rig.height), [&](std::size_t row) {
      for (int x = 0; x < rig.width; ++x) body(x, static_cast<int>(row));
    });
  };
  by_rows([&](int x, int y) { coarse(y, x) = misses(x, y); });
  cv::erode(coarse, low, cv::Mat());
  cv::dilate(coarse, high, cv::Mat());
  cv::Mat1b outside(rig.height * kFiner, rig.width * kFiner);
  by_rows([&](int x, int y) {
    for (int k = 0; k < kFiner * kFiner; ++k) {
      const int i = k % kFiner, j = k / kFiner;
      outside(y * kFiner + j, x * kFiner + i) =
          low(y, x) == high(y, x) ? coarse(y, x) : misses(x + (i + 0.5) / kFiner - 0.5, y + (j + 0.5) / kFiner - 0.5);
    }
  });
  cv::Mat1f away, within;
  cv::distanceTransform(outside, away, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(255 - outside, within, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  result.outside_px.create(rig.height, rig.width);
  for (int y = 0; y < rig.height; ++y) {
    for (int x = 0; x < rig.width; ++x) {
      const cv::Point at(x * kFiner + kFiner / 2, y * kFiner + kFiner / 2);
      const float d = away(at) - within(at);
      result.outside_px(y, x) = (d - std::copysign(0.5F, d)) / kFiner;
    }
  }
  return result;
}

RangeImage empty_range(const Projection& projection, const Transform& camera_from_pose) {
  RangeImage range{projection, camera_from_pose, {}, {}, {}, {}};
  const cv::Size size(projection.width, projection.height);
  range.depth = cv::Mat1f(size, kNan);
  range.sigma = cv::Mat1f(size, kNan);
  range.normal = cv::Mat3f(size, cv::Vec3f(kNan, kNan, kNan));
  return range;
}

void set_pixel(RangeImage& range, int x, int y, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
               double sigma) {
  range.depth(y, x) = static_cast<float>((range.camera_from_pose * point).z());
  range.sigma(y, x) = static_cast<float>(sigma);
  const Eigen::Vector3f n = (range.camera_from_pose.linear() * normal).cast<float>();
  range.normal(y, x) = {n.x(), n.y(), n.z()};
}

RangeImage take_range(const Rig& rig, const Cast& cast, const Transform& pose_from_turntable) {
  const Eigen::Vector3d eye = eye_at(rig, -80.0, 0.0);
  const Transform camera_from_turntable = look_at(eye, kTarget);
  RangeImage range = empty_range(projection_of(rig), camera_from_turntable * pose_from_turntable.inverse());
  if (rig.silhouettes) range.background = cv::Mat1b(rig.height, rig.width, uchar{0});
  const Transform pose_from_camera = range.camera_from_pose.inverse();
  const Eigen::Vector3d right = pose_from_turntable * eye_at(rig, 80.0, 0.0);
  const Eigen::Vector3d projector = pose_from_turntable * eye_at(rig, 0.0, 90.0);
  parallel_for(static_cast<std::size_t>(rig.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < rig.width; ++x) {
      const Eigen::Vector3d ray = pose_from_camera.linear() * range.projection.unproject(x, y, 1.0).normalized();
      const auto hit = cast(pose_from_camera.translation(), ray);
      if (!hit) {
        if (rig.silhouettes) range.background(y, x) = 255;
        continue;
      }
      const Eigen::Vector3d point = pose_from_camera.translation() + hit->distance * ray;
      if (hit->normal.dot(-ray) < std::cos(to_radians(rig.max_incidence_deg))) continue;
      if (rig.stereo && !(sees(cast, right, *hit, point, rig.max_incidence_deg) &&
                          sees(cast, projector, *hit, point, rig.max_incidence_deg))) {
        continue;
      }
      set_pixel(range, x, y, point, hit->normal, std::max(rig.noise_mm, 0.01));
    }
  });
  return range;
}

void add_noise(const Rig& rig, std::mt19937& random, RangeImage& range) {
  std::normal_distribution<float> noise(0.0F, static_cast<float>(rig.noise_mm));
  std::uniform_real_distribution<double> uniform;
  for (int y = 0; y < range.depth.rows; ++y) {
    for (int x = 0; x < range.depth.cols; ++x) {
      if (std::isnan(range.depth(y, x))) continue;
      if (rig.noise_mm > 0.0) range.depth(y, x) += noise(random);
      if (rig.dropouts > 0.0 && uniform(random) < rig.dropouts) range.depth(y, x) = range.sigma(y, x) = kNan;
    }
  }
}

}  // namespace

Solid sphere(const Eigen::Vector3d& centre, double radius) {
  return [=](const Eigen::Vector3d& p) { return (p - centre).norm() - radius; };
}

Solid box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = (low - p).cwiseMax(p - high);
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  };
}

Solid torus(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double ring, double tube) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = p - centre;
    const double along = q.dot(axis);
    return std::hypot((q - along * axis).norm() - ring, along) - tube;
  };
}

Solid rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  return [=](const Eigen::Vector3d& p) {
    const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    return (p - a - t * (b - a)).norm() - radius;
  };
}

Solid cylinder(double x, double z, double low, double high, double radius) {
  return [=](const Eigen::Vector3d& p) {
    const double r = std::hypot(p.x() - x, p.z() - z) - radius, h = std::max(low - p.y(), p.y() - high);
    return std::hypot(std::max(r, 0.0), std::max(h, 0.0)) + std::min(std::max(r, h), 0.0);
  };
}

Solid join(std::vector<Solid> parts) {
  return [parts = std::move(parts)](const Eigen::Vector3d& p) {
    double d = std::numeric_limits<double>::infinity();
    for (const auto& part : parts) d = std::min(d, part(p));
    return d;
  };
}

Solid carve(Solid from, Solid what) {
  return [=](const Eigen::Vector3d& p) { return std::max(from(p), -what(p)); };
}

Solid moved(Solid solid, const Transform& to_from) {
  return
      [solid = std::move(solid), from_to = to_from.inverse()](const Eigen::Vector3d& p) { return solid(from_to * p); };
}

Cast cast_into(Solid solid) {
  return [solid = std::move(solid)](const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction) -> std::optional<Hit> {
    double t = 0.0;
    for (int step = 0; step < 400 && t < 2.0 * kStandOff; ++step) {
      const double d = solid(origin + t * direction);
      if (d < 1e-5) {
        const Eigen::Vector3d p = origin + t * direction;
        Eigen::Vector3d normal;
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector3d h = 1e-4 * Eigen::Vector3d::Unit(k);
          normal[k] = solid(p + h) - solid(p - h);
        }
        return Hit{t, normal.normalized()};
      }
      if (t > 0.5 * kStandOff && (origin + t * direction - kTarget).norm() > 150.0 && step > 3) {
        if ((origin + t * direction - kTarget).dot(direction) > 0.0) return std::nullopt;  // past the object
      }
      t += d;
    }
    return std::nullopt;
  };
}

std::vector<View> take_views(const Rig& rig, const Cast& cast) {
  std::mt19937 random(rig.seed);
  std::vector<View> views;
  for (int i = 0; i < rig.views; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / rig.views;
    const Transform pose_from_turntable = rot_y(angle).inverse();
    View view{i, angle, take_range(rig, cast, pose_from_turntable), {}};
    if (rig.silhouettes) {
      for (const double side : {-80.0, 80.0}) {
        const Transform camera = look_at(eye_at(rig, side, 0.0), kTarget) * pose_from_turntable.inverse();
        view.silhouettes.push_back(take_silhouette(rig, cast, camera));
      }
    }
    add_noise(rig, random, view.range);
    views.push_back(std::move(view));
  }
  return views;
}

View take_orthographic(const Cast& cast, const Eigen::Vector3d& direction, const Eigen::Vector3d& centre,
                       double half_size_mm, double mm_per_pixel) {
  const int size = 2 * static_cast<int>(half_size_mm / mm_per_pixel) + 1;
  const double f = 1.0 / mm_per_pixel, c = 0.5 * (size - 1);
  const Projection projection{Projection::Kind::orthographic, size, size, f, f, c, c};
  const Eigen::Vector3d unit = direction.normalized();
  const Eigen::Vector3d aside = std::abs(unit.y()) > 0.9 ? Eigen::Vector3d(0.1, 0.0, 0.01) : Eigen::Vector3d::Zero();
  View view;
  view.range = empty_range(projection, look_at(centre - 300.0 * (unit + aside).normalized(), centre));
  const Transform pose_from_camera = view.range.camera_from_pose.inverse();
  const Eigen::Vector3d ray = pose_from_camera.linear().col(2);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Eigen::Vector3d start = pose_from_camera * projection.unproject(x, y, 0.0);
      const auto hit = cast(start, ray);
      if (!hit || hit->normal.dot(-ray) < 0.3) continue;
      set_pixel(view.range, x, y, start + hit->distance * ray, hit->normal, 0.02);
    }
  }
  return view;
}

Accuracy accuracy(const Mesh& mesh, const Solid& solid) {
  std::vector<double> errors;
  Accuracy result;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double error = std::abs(solid(mesh.vertices[v].cast<double>()));
    if (mesh.views[v] > 0) {
      errors.push_back(error);
    } else {
      result.greatest_closed = std::max(result.greatest_closed, error);
    }
  }
  if (errors.empty()) return result;
  std::sort(errors.begin(), errors.end());
  result.median = errors[errors.size() / 2];
  result.p95 = errors[errors.size() * 95 / 100];
  result.greatest = errors.back();
  result.measured_share = static_cast<double>(errors.size()) / static_cast<double>(mesh.vertices.size());
  return result;
}

}  // namespace scanrig::test
