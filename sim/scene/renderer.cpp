#include "sim/scene/renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/screen_colour.h"
#include "sim/scene/surface_colour.h"
#include "sim/scene/table_top.h"

namespace scanrig::sim {
namespace {

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

/// A lit place of a surface.
struct Place {
  Vector3d point, normal;  // turntable frame
  Vector3f albedo;
  double footprint = 0.0;               // averaging width on the surface, mm
  Vector3f bounced = Vector3f::Zero();  // irradiance by the projector's light from elsewhere
  const Material* material = nullptr;
};

class Shot {
 public:
  Shot(const Placed& placed, const Eye& camera, const Eye& projector, const DotPattern& dots, double angle,
       const ViewEffects& added)
      : placed_(placed),
        camera_(camera),
        added_(added),
        lamp_(projector, dots, added.effects, added.handling.finger),
        backdrop_(added.colour),
        screen_albedo_(on_screen(profile().backdrop_albedo, added.colour)) {
    turntable_from_table_ = rot_y(angle);
    turntable_from_object_ = turntable_from_table_ * placed.table_from_object;
    object_from_turntable_ = turntable_from_object_.inverse();
    eye_ = camera.centre();
    const auto& vertices = placed.object.mesh.vertices;
    Eigen::AlignedBox3d box;
    for (const auto& v : vertices) box.extend(v);
    for (const auto& v : vertices) radius_ = std::max(radius_, (v - box.center()).norm());
    middle_ = turntable_from_object_ * box.center();
    const Vector3d aim(0.0, profile().aim_height_mm, 0.0);
    focus_ = (camera.eye_from_turntable * aim).z() + camera.focus_off_mm;
    if (added.handling.sticker > 0.0 || added.handling.shadow > 0.0) spot_ = spot_near_contour();
  }

  /// `width`: of the sample, in pixels.
  [[nodiscard]] Sample sample(double u, double v, double width) const {
    const Vector3d in_eye = added_.rays ? added_.rays->ray(u, v) : camera_.ray(u, v);
    const Vector3d way = camera_.eye_from_turntable.linear().transpose() * in_eye;  // its length is 1 / cos off axis
    if (const auto hit = first_hit(eye_, way); hit.triangle >= 0) return object_sample(hit, way, width);
    const double to_table = -eye_.y() / way.y();
    const Vector3d on_table = eye_ + to_table * way;
    if (to_table > 0.0 && std::hypot(on_table.x(), on_table.z()) < profile().table_radius_mm) {
      Sample s = table_sample(on_table, to_table, width);
      if (added_.effects.table_gloss > 0.0) mirror_in_table(s, on_table, way, width);
      return s;
    }
    const double t = backdrop_.distance(eye_, way);
    return backdrop_sample(eye_ + t * way, t);
  }

 private:
  [[nodiscard]] bool near_object(const Vector3d& from, const Vector3d& way) const {
    const Vector3d d = middle_ - from;
    return d.cross(way).squaredNorm() <= radius_ * radius_ * way.squaredNorm();
  }

  [[nodiscard]] RayCaster::Hit first_hit(const Vector3d& from, const Vector3d& way) const {
    if (!near_object(from, way)) return {};
    return placed_.rays.first_hit(object_from_turntable_ * from, object_from_turntable_.linear() * way);
  }

  [[nodiscard]] bool in_shadow(const Vector3d& point, const Vector3d& normal) const {
    const Vector3d from = point + 0.02 * normal;  // off its own surface
    const Vector3d way = lamp_.place() - from;
    if (!near_object(from, way)) return false;
    return placed_.rays.blocked(object_from_turntable_ * from, object_from_turntable_.linear() * way);
  }

  /// Place in the object's frame, as near to its contour as the projector reaches at mid-height.
  [[nodiscard]] Vector3d spot_near_contour() const {
    for (double beside = 0.95; beside > -1.0; beside -= 0.05) {
      const Vector3d way = middle_ + Vector3d(beside * radius_, 0.0, 0.0) - lamp_.place();
      const auto hit = first_hit(lamp_.place(), way);
      if (hit.triangle >= 0) return placed_.object.mesh.vertices[placed_.object.mesh.triangles[hit.triangle][0]];
    }
    return Vector3d::Zero();
  }

  /// Adds the projector's light on a surface, seen along `way`.
  void light_up(Sample& s, const Place& at, const Vector3d& way) const {
    s.pattern = static_cast<float>(profile().pattern_room_light) * s.plain;
    s.pattern += at.albedo.cwiseProduct(at.bounced);
    const Vector3d to_lamp = (lamp_.place() - at.point).normalized();
    const double cosine = at.normal.dot(to_lamp);
    s.lit = cosine > 0.0 && !in_shadow(at.point, at.normal);
    if (!s.lit) return;
    const double averaged = kBoxSigma * at.footprint;
    const double light = lamp_.irradiance(lamp_.beam(at.point, averaged), cosine);
    if (at.material == nullptr || at.material->scattered == 0.0) {
      s.pattern += static_cast<float>(light) * at.albedo;
    } else {
      const Material& m = *at.material;
      const auto beam = lamp_.beam(at.point - m.scatter_deep_mm * at.normal, std::hypot(averaged, m.scatter_mm));
      const double mixed = (1.0 - m.scattered - m.glow) * light + m.scattered * lamp_.irradiance(beam, cosine) +
                           m.glow * lamp_.mean_irradiance(beam, cosine);
      s.pattern += static_cast<float>(mixed) * at.albedo;
    }
    if (at.material && at.material->normal_reflectance > 0.0) {
      const double mirrored = at.material->gloss().towards(at.normal, -way.normalized(), to_lamp);
      s.pattern += Vector3f::Constant(static_cast<float>(light * mirrored));
    }
  }

  /// Adds what a glossy surface mirrors of soft boxes and room to the plain light.
  void mirror_room(Sample& s, const Place& at, const Surroundings& around, const Vector3d& way) const {
    const Profile& p = profile();
    const Gloss gloss = at.material->gloss();
    const Vector3d to_eye = -way.normalized();
    const double cosine = at.normal.dot(to_eye);
    const double open = around.openness, reached = p.broad_lights * open * std::sqrt(open);
    double boxes = 0.0;
    for (const auto& box : RoomLight::soft_boxes()) {
      const double arrives = box.share * std::max(0.0, at.normal.dot(box.towards));
      boxes += arrives * gloss.widened(kBoxRadius).towards(at.normal, to_eye, box.towards);
    }
    s.plain += Vector3f::Constant(static_cast<float>(reached * boxes));
    // A narrow lobe sees one direction, a wide one the mean of what is open.
    const Vector3d mirrored = 2.0 * cosine * at.normal - to_eye, from = at.point + 0.05 * at.normal;
    double visible = open;
    if (gloss.alpha < 0.1) visible = first_hit(from, mirrored).triangle < 0 ? 1.0 : 0.0;
    const Vector3f own = 0.4F * at.albedo;  // of other parts of the object
    const Vector3f seen = static_cast<float>(visible) * room_along(from, mirrored, 2.0 * gloss.alpha) +
                          static_cast<float>(1.0 - visible) * own;
    s.plain += static_cast<float>(gloss.mirrored(cosine)) * seen;
  }

  /// Plain light that arrives at `from` along -`way`, averaged over a lobe of about `spread` (rad); the object left
  /// out.
  [[nodiscard]] Vector3f room_along(const Vector3d& from, const Vector3d& way, double spread) const {
    const Profile& p = profile();
    constexpr double kScreenReach = 350.0;  // mm around its middle; beyond it is the room
    const double wide = std::max(spread, 0.01), rise = way.normalized().y();
    const auto upwards = static_cast<float>(std::clamp(0.5 + rise / (2.0 * wide), 0.0, 1.0));
    const auto sky = static_cast<float>(p.ambient);
    const Vector3f above = Vector3f::Constant(sky * static_cast<float>(0.7 + 0.3 * std::max(0.0, rise)));
    Vector3f below = 0.5F * sky * screen_albedo_;
    if (rise < 0.0) {
      const Vector3d on_table = from - from.y() / way.y() * way;
      if (std::hypot(on_table.x(), on_table.z()) < p.table_radius_mm)
        below = 0.8F * on_screen(p.table_albedo, added_.colour);
    }
    const Vector3f room = upwards * above + (1.0F - upwards) * below;
    const double to_screen = way.dot(backdrop_.normal) < 0.0 ? backdrop_.distance(from, way) : -1.0;
    if (to_screen <= 0.0) return room;
    const Vector3d on_screen = from + to_screen * way, off_middle = on_screen - backdrop_.point;
    const double blur = 2.0 * wide * to_screen * way.norm();
    const double inside = std::min(on_screen.y(), kScreenReach - off_middle.norm());
    const auto screen = static_cast<float>(std::clamp(0.5 + inside / blur, 0.0, 1.0));
    if (screen == 0.0F) return room;
    // A wide lobe around a way that nearly misses the screen still sees its edge.
    const Vector3d seen = backdrop_.point + std::min(1.0, kScreenReach / off_middle.norm()) * off_middle;
    return screen * backdrop_.plain_light(seen) + (1.0F - screen) * room;
  }

  /// Averaging width of one sample on a surface, as the width of a box of the same standard deviation: mm.
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
    Place at;
    at.point = turntable_from_object_ * in_object;
    at.normal = turntable_from_object_.linear() * smooth;
    // An open mesh may show its back; smooth normals at a rim may lean away by a little.
    Vector3d facet = turntable_from_object_.linear() *
                     (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).normalized();
    if (facet.dot(way) > 0.0) facet = -facet, at.normal = -at.normal;

    Sample s;
    s.surface = Surface::object;
    s.depth = (camera_.eye_from_turntable * at.point).z();
    at.footprint = footprint(s.depth, -facet.dot(way) / way.norm(), width);
    at.albedo = object.colour->albedo({in_object, hit.triangle, hit.u, hit.v, at.footprint});
    at.material = &object.materials.at(in_object);
    const auto u = static_cast<float>(hit.u), v = static_cast<float>(hit.v), w = 1.0F - u - v;
    if (added_.bounce) {
      const auto& bounce = *added_.bounce;
      at.bounced = w * bounce.at_vertex(t[0]) + u * bounce.at_vertex(t[1]) + v * bounce.at_vertex(t[2]);
    }
    const float spoilt = spot_ ? Handling::patch(in_object, *spot_, kSpotReach) : 0.0F;
    if (spoilt > 0.0F) at.albedo += spoilt * static_cast<float>(added_.handling.sticker) * (screen_albedo_ - at.albedo);
    const std::array<Surroundings, 3> corner = {placed_.light.at_vertex(t[0]), placed_.light.at_vertex(t[1]),
                                                placed_.light.at_vertex(t[2])};
    const Surroundings around{w * corner[0].ambient + u * corner[1].ambient + v * corner[2].ambient,
                              w * corner[0].openness + u * corner[1].openness + v * corner[2].openness};
    s.plain = at.albedo.cwiseProduct(RoomLight::irradiance(around, at.normal));
    if (at.material->normal_reflectance > 0.0) mirror_room(s, at, around, way);
    if (spoilt > 0.0F) {
      const float lost = spoilt * static_cast<float>(added_.handling.shadow);
      s.plain = (1.0F - lost) * s.plain + lost * 0.9F * at.albedo.cwiseProduct(screen_albedo_);
    }
    light_up(s, at, way);
    return s;
  }

  [[nodiscard]] Sample table_sample(const Vector3d& point, double depth, double width) const {
    const Profile& p = profile();
    const Vector3d in_table = turntable_from_table_.inverse() * point;
    Place at{point, Vector3d::UnitY(), Vector3f::Zero(), footprint(depth, 0.4, width)};
    const float dot = static_cast<float>(rim_dot_share(in_table, at.footprint, placed_.rim_dots));
    at.albedo =
        (1.0F - dot) * on_screen(p.table_albedo, added_.colour) + dot * on_screen(p.rim_dot_albedo, added_.colour);
    if (added_.bounce) at.bounced = added_.bounce->on_table(in_table.x(), in_table.z());
    Sample s;
    s.surface = Surface::table;
    s.depth = depth;
    s.plain = at.albedo.cwiseProduct(
        RoomLight::irradiance(placed_.light.on_table(in_table.x(), in_table.z()), Vector3d::UnitY()));
    light_up(s, at, point - eye_);
    return s;
  }

  /// Adds what the table's gloss mirrors: the object, the screen, the room.
  void mirror_in_table(Sample& s, const Vector3d& on_table, const Vector3d& way, double width) const {
    const Vector3d up(way.x(), -way.y(), way.z()), from = on_table + Vector3d(0.0, 0.02, 0.0);
    const auto share = static_cast<float>(added_.effects.table_gloss);
    if (const auto hit = first_hit(from, up); hit.triangle >= 0) {
      const Sample mirrored = object_sample(hit, up, width);
      s.plain += share * mirrored.plain;
      s.pattern += share * mirrored.pattern;
      return;
    }
    const Vector3f room = share * room_along(from, up, 0.0);
    s.plain += room;
    s.pattern += static_cast<float>(profile().pattern_room_light) * room;
  }

  [[nodiscard]] Sample backdrop_sample(const Vector3d& point, double depth) const {
    Place at{point, backdrop_.normal, screen_albedo_, footprint(depth, 1.0, 1.0)};
    Sample s;
    s.depth = depth;
    s.plain = backdrop_.plain_light(point);
    if (added_.screen) {
      const ScreenLight::Change change = added_.screen->at(point);
      s.plain = change.factor * s.plain + screen_albedo_.cwiseProduct(change.colour);
      at.albedo *= static_cast<float>(added_.screen->fold(point));
    }
    light_up(s, at, point - eye_);
    return s;
  }

  static constexpr double kBoxSigma = 0.288675;  // of a box one wide
  static constexpr double kBoxRadius = 0.46;     // rad: a soft box as wide as its distance
  static constexpr double kSpotReach = 9.0;      // mm, of what spoils a silhouette

  const Placed& placed_;
  const Eye& camera_;
  const ViewEffects& added_;
  const Lamp lamp_;
  Transform turntable_from_table_, turntable_from_object_, object_from_turntable_;
  Vector3d eye_, middle_;
  const Backdrop backdrop_;
  const Vector3f screen_albedo_;
  double radius_ = 0.0, focus_ = 0.0;
  std::optional<Vector3d> spot_;  // in the object's frame
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
                std::uint64_t sampling_seed, const ViewEffects& effects) {
  const Shot shot(placed, camera, projector, dots, angle, effects);
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
