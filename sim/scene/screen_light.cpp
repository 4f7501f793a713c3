#include "sim/scene/screen_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "sim/scene/gathering.h"

namespace scanrig::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr int kColumns = 49, kRows = 37;  // odd: one of each is the middle
constexpr int kMiddleColumn = kColumns / 2, kMiddleRow = kRows / 2;
constexpr double kScreenStep = 10.0;  // mm between nodes
constexpr int kBoxRays = 16;          // to each soft box
constexpr double kBoxRadius = 0.46;   // rad: a box as wide as its distance
constexpr int kColourRays = 64;
constexpr double kFar = 1000.0;  // mm
constexpr double kFree = 0.8;    // of the sky above, as of Backdrop::plain_light

/// Share of a soft box that no part of the object hides.
double open_to(const Vector3d& towards, const std::vector<Vector3d>& disc, const auto& is_blocked) {
  const Eigen::Matrix3d frame = frame_around(towards);
  int open = 0;
  for (const auto& d : disc) {
    const Vector3d way = frame * Vector3d(kBoxRadius * d.x(), kBoxRadius * d.y(), 1.0);
    open += is_blocked(way) ? 0 : 1;
  }
  return static_cast<double>(open) / static_cast<double>(disc.size());
}

}  // namespace

ScreenLight::ScreenLight(const Effects& effects, const Object& object, const RayCaster& rays, const RoomLight& light,
                         const Transform& turntable_from_object)
    : effects_(effects), along_(Vector3d::UnitX()), up_(screen_.normal.cross(Vector3d::UnitX())) {
  if (effects.screen_shadow == 0.0) return;
  const Profile& p = profile();
  const Transform object_from_turntable = turntable_from_object.inverse();
  const auto disc = hemisphere(kBoxRays), over_screen = hemisphere(kColourRays);
  const Eigen::Matrix3d frame = frame_around(screen_.normal);
  nodes_.resize(kColumns * kRows);
  parallel_for(kRows, [&](std::size_t row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vector3d from =
          screen_.point +
          kScreenStep * ((column - kMiddleColumn) * along_ + (static_cast<double>(row) - kMiddleRow) * up_) +
          0.1 * screen_.normal;
      const auto turned = [&](const Vector3d& way) { return Vector3d(object_from_turntable.linear() * way); };
      const Vector3d origin = object_from_turntable * from;
      const auto is_blocked = [&](const Vector3d& way) { return rays.blocked(origin, turned(kFar * way)); };
      double direct = 0.0, reached = 0.0;
      for (const auto& box : RoomLight::soft_boxes()) {
        const double cosine = box.share * std::max(0.0, (screen_.normal.dot(box.towards) + 0.5) / 1.5);
        direct += cosine;
        reached += cosine == 0.0 ? 0.0 : cosine * open_to(box.towards, disc, is_blocked);
      }
      Vector3f colour = Vector3f::Zero();
      int hidden = 0;
      for (const auto& d : over_screen) {
        const auto hit = rays.first_hit(origin, turned(frame * d));
        if (hit.triangle < 0) continue;
        ++hidden;
        const auto& t = object.mesh.triangles[hit.triangle];
        const Vector3f albedo =
            object.colour->albedo({object.mesh.vertices[t[0]], hit.triangle, 0.0, 0.0, kScreenStep});
        const Vector3d normal = turntable_from_object.linear() * object.normals[t[0]];
        colour += albedo.cwiseProduct(RoomLight::irradiance(light.at_vertex(t[0]), normal));
      }
      const double open = 1.0 - static_cast<double>(hidden) / kColourRays;
      const double free = p.ambient * kFree + p.broad_lights * direct;
      const double factor = (p.ambient * kFree * open + p.broad_lights * reached) / free;
      const double share = effects.screen_shadow;
      nodes_[row * kColumns + column] = {static_cast<float>(1.0 + share * (factor - 1.0)),
                                         static_cast<float>(share / kColourRays) * colour};
    }
  });
}

Vector2d ScreenLight::on_screen(const Vector3d& point) const {
  const Vector3d d = point - screen_.point;
  return {d.dot(along_), d.dot(up_)};
}

double ScreenLight::fold(const Vector3d& point) const {
  if (effects_.folds == 0.0 && effects_.folds_dark == 0.0) return 1.0;
  const Vector2d at = on_screen(point);
  // Folds hang down, a hand's width apart, and wander; between two a smaller one.
  const double x = at.x() + 9.0 * std::sin(at.y() / 55.0 + 0.6) + 4.0 * std::sin(at.y() / 23.0);
  const double wave =
      0.6 * std::sin(x / 21.0) + 0.3 * std::sin(x / 9.3 + 1.1 + at.y() / 140.0) + 0.1 * std::sin(x / 4.1 + 0.3);
  return 1.0 - effects_.folds_dark + effects_.folds * wave;
}

ScreenLight::Change ScreenLight::at(const Vector3d& point) const {
  Change change;
  const auto folded = static_cast<float>(fold(point));
  change.factor = folded;
  if (nodes_.empty()) return change;
  const Vector2d at = on_screen(point) / kScreenStep;
  const double u = std::clamp(at.x() + kMiddleColumn, 0.0, kColumns - 1.001);
  const double v = std::clamp(at.y() + kMiddleRow, 0.0, kRows - 1.001);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const auto x = static_cast<float>(u - i), y = static_cast<float>(v - j);
  const Change* n = &nodes_[j * kColumns + i];
  const auto mixed = [&](auto what) {
    return ((1.0F - y) * ((1.0F - x) * what(n[0]) + x * what(n[1])) +
            y * ((1.0F - x) * what(n[kColumns]) + x * what(n[kColumns + 1])));
  };
  change.factor *= mixed([](const Change& c) { return c.factor; });
  for (int c = 0; c < 3; ++c) change.colour[c] = folded * mixed([c](const Change& node) { return node.colour[c]; });
  return change;
}

}  // namespace scanrig::sim
