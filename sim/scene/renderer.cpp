#include "sim/scene/renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/surface_colour.h"
#include "sim/scene/table_top.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

enum class Surface { backdrop, table, object };

struct Sample {
  Vector3f plain = Vector3f::Zero();
  Vector3f pattern = Vector3f::Zero();
  Surface surface = Surface::backdrop;
  bool lit = true;     // by the projector
  double depth = 0.0;  // mm along the camera's axis
};

class Shot {
 public:
  Shot(const Placed& placed, const Eye& camera, const Eye& projector, const DotPattern& dots, double angle)
      : placed_(placed), camera_(camera), projector_(projector), dots_(dots) {
    turntable_from_table_ = rot_y(angle);
    turntable_from_object_ = turntable_from_table_ * placed.table_from_object;
    object_from_turntable_ = turntable_from_object_.inverse();
    eye_ = camera.centre();
    lamp_ = projector.centre();
    const auto& vertices = placed.object.mesh.vertices;
    Eigen::AlignedBox3d box;
    for (const auto& v : vertices) box.extend(v);
    for (const auto& v : vertices) radius_ = std::max(radius_, (v - box.center()).norm());
    middle_ = turntable_from_object_ * box.center();
    const Vector3d aim(0.0, profile().aim_height_mm, 0.0);
    focus_ = (camera.eye_from_turntable * aim).z();
    lamp_focus_ = (projector.eye_from_turntable * aim).z();
  }

  /// `width`: of the sample, in pixels.
  [[nodiscard]] Sample sample(double u, double v, double width) const {
    const Vector3d in_eye = camera_.ray(u, v);
    const Vector3d way = camera_.eye_from_turntable.linear().transpose() * in_eye;  // its length is 1 / cos off axis
    if (near_object(eye_, way)) {
      const auto hit = placed_.rays.first_hit(object_from_turntable_ * eye_, object_from_turntable_.linear() * way);
      if (hit.triangle >= 0) return object_sample(hit, way, width);
    }
    const double to_table = -eye_.y() / way.y();
    const Vector3d on_table = eye_ + to_table * way;
    if (to_table > 0.0 && std::hypot(on_table.x(), on_table.z()) < profile().table_radius_mm) {
      return table_sample(on_table, to_table, width);
    }
    const double t = backdrop_.distance(eye_, way);
    return backdrop_sample(eye_ + t * way, t);
  }

 private:
  [[nodiscard]] bool near_object(const Vector3d& from, const Vector3d& way) const {
    const Vector3d d = middle_ - from;
    return d.cross(way).squaredNorm() <= radius_ * radius_ * way.squaredNorm();
  }

  [[nodiscard]] bool in_shadow(const Vector3d& point, const Vector3d& normal) const {
    const Vector3d from = point + 0.02 * normal;  // off its own surface
    const Vector3d way = lamp_ - from;
    if (!near_object(from, way)) return false;
    return placed_.rays.blocked(object_from_turntable_ * from, object_from_turntable_.linear() * way);
  }

  /// Adds the projector's light on a surface; `footprint`: mm on the surface.
  void light_up(Sample& s, const Vector3d& point, const Vector3d& normal, const Vector3f& albedo,
                double footprint) const {
    const Profile& p = profile();
    s.pattern = static_cast<float>(p.pattern_room_light) * s.plain;
    const Vector3d to_lamp = (lamp_ - point).normalized();
    const double cosine = normal.dot(to_lamp);
    s.lit = cosine > 0.0 && !in_shadow(point, normal);
    if (!s.lit) return;
    const Vector3d q = projector_.eye_from_turntable * point;
    const double u = projector_.fx * q.x() / q.z() + projector_.cx, v = projector_.fy * q.y() / q.z() + projector_.cy;
    const double defocus = p.projector_defocus_px_per_mm * std::abs(q.z() - lamp_focus_);
    const double averaged = kBoxSigma * footprint * projector_.fx / q.z();
    const double sigma = std::hypot(p.projector_sigma_px, defocus, averaged);
    const double dots = p.projector_black + (1.0 - p.projector_black) * dots_.brightness(u, v, sigma);
    const double light = p.projector_light * dots * cosine * std::pow(lamp_focus_ / q.z(), 2.0);
    s.pattern += static_cast<float>(light) * albedo;
  }

  /// Standard deviation of the averaging width of one sample, as the width of a box with the same: mm on the surface.
  [[nodiscard]] double footprint(double depth, double cosine, double width) const {
    const double blur = profile().defocus_px_per_mm * std::abs(depth - focus_) * camera_.fx / profile().focal_px;
    const double pixels = std::hypot(width, blur / kBoxSigma);
    return pixels * depth / camera_.fx / std::sqrt(std::max(cosine, 0.1));
  }

  [[nodiscard]] Sample object_sample(const RayCaster::Hit& hit, const Vector3d& way, double width) const {
    const Object& object = placed_.object;
    const auto& t = object.mesh.triangles[hit.triangle];
    const auto mixed = [&](const auto& a, const auto& b, const auto& c) {
      return Vector3d((1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c);
    };
    const auto& vertices = object.mesh.vertices;
    const Vector3d in_object = mixed(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    const Vector3d smooth = mixed(object.normals[t[0]], object.normals[t[1]], object.normals[t[2]]).normalized();
    const Vector3d point = turntable_from_object_ * in_object;
    Vector3d normal = turntable_from_object_.linear() * smooth;
    // An open mesh may show its back; smooth normals at a rim may lean away by a little.
    Vector3d facet = turntable_from_object_.linear() *
                     (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).normalized();
    if (facet.dot(way) > 0.0) facet = -facet, normal = -normal;

    Sample s;
    s.surface = Surface::object;
    s.depth = (camera_.eye_from_turntable * point).z();
    const double size = footprint(s.depth, -facet.dot(way) / way.norm(), width);
    const Vector3f albedo = object.colour->albedo({in_object, hit.triangle, hit.u, hit.v, size});
    const std::array<Surroundings, 3> corner = {placed_.light.at_vertex(t[0]), placed_.light.at_vertex(t[1]),
                                                placed_.light.at_vertex(t[2])};
    const auto u = static_cast<float>(hit.u), v = static_cast<float>(hit.v), w = 1.0F - u - v;
    const Surroundings around{w * corner[0].ambient + u * corner[1].ambient + v * corner[2].ambient,
                              w * corner[0].openness + u * corner[1].openness + v * corner[2].openness};
    s.plain = albedo.cwiseProduct(RoomLight::irradiance(around, normal));
    light_up(s, point, normal, albedo, size);
    return s;
  }

  [[nodiscard]] Sample table_sample(const Vector3d& point, double depth, double width) const {
    const Profile& p = profile();
    const Vector3d in_table = turntable_from_table_.inverse() * point;
    const double size = footprint(depth, 0.4, width);
    const float dot = static_cast<float>(rim_dot_share(in_table, size, placed_.rim_dots));
    const Vector3f albedo = (1.0F - dot) * rgb(p.table_albedo) + dot * rgb(p.rim_dot_albedo);
    Sample s;
    s.surface = Surface::table;
    s.depth = depth;
    s.plain = albedo.cwiseProduct(
        RoomLight::irradiance(placed_.light.on_table(in_table.x(), in_table.z()), Vector3d::UnitY()));
    light_up(s, point, Vector3d::UnitY(), albedo, size);
    return s;
  }

  [[nodiscard]] Sample backdrop_sample(const Vector3d& point, double depth) const {
    Sample s;
    s.depth = depth;
    s.plain = backdrop_.plain_light(point);
    light_up(s, point, backdrop_.normal, rgb(profile().backdrop_albedo), footprint(depth, 1.0, 1.0));
    return s;
  }

  static constexpr double kBoxSigma = 0.288675;  // of a box one wide

  const Placed& placed_;
  const Eye& camera_;
  const Eye& projector_;
  const DotPattern& dots_;
  Transform turntable_from_table_, turntable_from_object_, object_from_turntable_;
  Vector3d eye_, lamp_, middle_;
  const Backdrop backdrop_;
  double radius_ = 0.0, focus_ = 0.0, lamp_focus_ = 0.0;
};

/// Whether these samples see one smooth surface.
bool differ(const std::array<Sample, 4>& s) {
  constexpr double kStep = 0.8;  // mm of depth within a pixel: a slope of 80 degrees
  for (int i = 1; i < 4; ++i) {
    if (s[i].surface != s[0].surface || s[i].lit != s[0].lit) return true;
    if (s[0].surface == Surface::object && std::abs(s[i].depth - s[0].depth) > kStep) return true;
  }
  return false;
}

struct Pixel {
  Vector3f plain = Vector3f::Zero();
  Vector3f pattern = Vector3f::Zero();
};

Pixel render_pixel(const Shot& shot, int x, int y, std::uint64_t bits) {
  const double turn = 0.5 * std::numbers::pi * uniform(bits);
  constexpr double kArm = 0.35355;  // half the diagonal of a half-pixel square
  std::array<Sample, 4> four;
  for (int i = 0; i < 4; ++i) {
    const double phi = turn + 0.5 * std::numbers::pi * i;
    four[i] = shot.sample(x + kArm * std::cos(phi), y + kArm * std::sin(phi), 0.5);
  }
  Pixel pixel;
  if (!differ(four)) {
    for (const auto& s : four) pixel.plain += 0.25F * s.plain, pixel.pattern += 0.25F * s.pattern;
    return pixel;
  }
  for (int i = 0; i < 16; ++i) {
    bits = mix(bits);
    const int column = i % 4, row = i / 4;
    const double u = (column + uniform(bits)) / 4.0 - 0.5, v = (row + uniform(mix(bits + 1))) / 4.0 - 0.5;
    const Sample s = shot.sample(x + u, y + v, 0.25);
    pixel.plain += s.plain / 16.0F, pixel.pattern += s.pattern / 16.0F;
  }
  return pixel;
}

}  // namespace

Radiance render(const Placed& placed, const Eye& camera, const Eye& projector, const DotPattern& dots, double angle,
                std::uint64_t sampling_seed) {
  const Shot shot(placed, camera, projector, dots, angle);
  Radiance out{cv::Mat(camera.height, camera.width, CV_32FC3), cv::Mat(camera.height, camera.width, CV_32FC3)};
  parallel_for(static_cast<std::size_t>(camera.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < camera.width; ++x) {
      const Pixel p = render_pixel(shot, x, y, mix(sampling_seed, row, x));
      out.plain.at<cv::Vec3f>(y, x) = {p.plain.x(), p.plain.y(), p.plain.z()};
      out.pattern.at<cv::Vec3f>(y, x) = {p.pattern.x(), p.pattern.y(), p.pattern.z()};
    }
  });
  return out;
}

}  // namespace scanrig::sim
