#include "tests/bench/pose/campaign_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/transform.h"
#include "core/units.h"
#include "tests/bench/pose/campaign_solids.h"

namespace scanrig::campaign {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCellMm = 1.4;

/// `solid` as `target_from_solid` lays it.
Distance laid(Distance solid, const Transform& target_from_solid) {
  return [solid = std::move(solid), back = Transform(target_from_solid.inverse())](const Vector3d& p) {
    return solid(back * p);
  };
}

/// Points of a smooth curve through `knots` [Catmull and Rom 1974].
std::vector<Vector3d> smooth_curve(const std::vector<Vector3d>& knots, int steps) {
  std::vector<Vector3d> points;
  const auto knot = [&](int i) { return knots[static_cast<std::size_t>(std::clamp(i, 0, int(knots.size()) - 1))]; };
  for (int i = 0; i + 1 < static_cast<int>(knots.size()); ++i) {
    for (int k = 0; k < steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      const Vector3d a = knot(i - 1), b = knot(i), c = knot(i + 1), d = knot(i + 2);
      points.emplace_back(0.5 * (2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t +
                                 (3.0 * b - 3.0 * c + d - a) * t * t * t));
    }
  }
  points.push_back(knots.back());
  return points;
}

Distance bent_tube(Chance& c) {
  std::vector<Vector3d> knots = {Vector3d(c.between(-5, 5), c.between(-5, 5), -42)};
  for (int k = 1; k < 5; ++k) knots.emplace_back(c.between(-24, 24), c.between(-20, 20), -42 + 21 * k);
  auto points = smooth_curve(knots, 6);
  std::vector<double> radii;
  const double thick = c.between(7, 11), thin = c.between(5, 7), wave = c.between(0.5, 1.5);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(points.size());
    radii.push_back(thick + t * (thin - thick) + 0.7 * std::sin(2.0 * std::numbers::pi * wave * t));
  }
  return chain(std::move(points), std::move(radii));
}

Distance handle(Chance& c, double radius, double height) {
  const double size = c.between(0.14, 0.34) * height, thickness = c.between(2.5, 5.0);
  const Vector3d at(radius, c.between(0.35, 0.65) * height, 0);
  return ring(at, Vector3d::UnitZ(), size, thickness);
}

Distance mug(Chance& c) {
  const double height = c.between(45, 75), foot = c.between(16, 24), rim = foot + c.between(-3, 7),
               wall = c.between(3, 5);
  const Distance outer = lathed({{0, 0}, {foot, 0}, {rim, height}, {0, height}});
  const Distance inner = lathed({{0, 6}, {foot - wall, 6}, {rim - wall, height + 9}, {0, height + 9}});
  return laid(without(united({outer, handle(c, 0.5 * (foot + rim), height)}), inner),
              Transform(Eigen::Translation3d(0, -0.5 * height, 0)));
}

Distance ribbed_box(Chance& c) {
  const Vector3d half(c.between(20, 38), c.between(12, 26), c.between(14, 30));
  std::vector<Distance> parts = {block(-half, half)};
  for (int k = c.among(4) + 2; k > 0; --k) {
    const int side = c.among(3), along = (side + 1 + c.among(2)) % 3, across = 3 - side - along;
    Vector3d low, high;
    const double sign = c.sign(), begin = c.between(-0.9, 0.1) * half[along],
                 middle = c.between(-0.7, 0.7) * half[across];
    low[side] = sign > 0 ? 0.5 * half[side] : -half[side] - c.between(4, 9);
    high[side] = sign > 0 ? half[side] + c.between(4, 9) : -0.5 * half[side];
    low[along] = begin;
    high[along] = begin + c.between(0.6, 1.0) * half[along];
    low[across] = middle - c.between(2, 5);
    high[across] = middle + c.between(2, 5);
    parts.push_back(block(low, high));
  }
  return united(std::move(parts));
}

Distance plate(Chance& c) {
  const Vector3d half(c.between(30, 42), c.between(3, 5), c.between(20, 32));
  std::vector<Distance> parts = {block(-half, half)};
  const auto place = [&] { return Vector3d(c.between(-0.7, 0.7) * half.x(), 0, c.between(-0.7, 0.7) * half.z()); };
  for (int k = c.among(3) + 1; k > 0; --k) {
    const Vector3d at = place(), up = c.sign() * (half.y() + c.between(4, 14)) * Vector3d::UnitY();
    parts.push_back(rod(at, at + up, c.between(4, 9)));
  }
  Distance solid = united(std::move(parts));
  for (int k = c.among(3); k > 0; --k) {
    const Vector3d at = place();
    solid = without(std::move(solid), rod(at - 40 * Vector3d::UnitY(), at + 40 * Vector3d::UnitY(), c.between(3, 8)));
  }
  return solid;
}

Distance wedge(Chance& c) {
  const Vector3d half(c.between(25, 40), c.between(18, 30), c.between(18, 30));
  std::vector<Distance> parts = {block(-half, half)};
  for (int k = c.among(3) + 2; k > 0; --k) {
    const Vector3d normal = c.direction();
    parts.push_back(half_space(normal, c.between(0.35, 0.7) * half.dot(normal.cwiseAbs())));
  }
  return common(std::move(parts));
}

/// A long rod of hardly round section with something at its ends.
Distance long_thin(Chance& c) {
  const double length = c.between(42, 48), radius = c.between(6, 9);
  const Distance bar = rod({0, 0, -length}, {0, 0, length}, radius);
  const Vector3d normal(std::cos(1.0), std::sin(1.0), 0);
  const Distance flattened = common({bar, half_space(normal, c.between(0.75, 0.95) * radius)});
  std::vector<Distance> parts = {flattened};
  const double at = c.between(0.3, 0.9) * length;
  parts.push_back(ball({c.between(0.4, 0.9) * radius, 0, at}, c.between(0.5, 0.9) * radius));
  if (c.among(2) == 0) parts.push_back(block({-radius - 2, -2, -length}, {radius + 3, 3, -length + c.between(6, 16)}));
  return blended(std::move(parts), 2.0);
}

Distance knot(Chance& c) {
  constexpr int kSteps = 90;
  std::vector<Vector3d> points;
  std::vector<double> radii;
  const double scale = c.between(10.5, 12.5), thick = c.between(5, 6.5), wave = c.between(0.6, 1.4),
               rise = c.between(1.0, 1.6);
  for (int i = 0; i <= kSteps; ++i) {
    const double t = 2.0 * std::numbers::pi * i / kSteps;
    points.emplace_back(scale * Vector3d(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t),
                                         -rise * std::sin(3 * t)));
    radii.push_back(thick + wave * std::sin(t));
  }
  return chain(std::move(points), std::move(radii));
}

Distance blob(Chance& c) {
  std::vector<Distance> parts = {ball(Vector3d::Zero(), c.between(18, 24))};
  for (int k = c.among(4) + 4; k > 0; --k) parts.push_back(ball(c.between(14, 32) * c.direction(), c.between(8, 17)));
  return blended(std::move(parts), c.between(6, 14));
}

Distance blocks(Chance& c) {
  std::vector<Distance> parts;
  Vector3d at = Vector3d::Zero();
  for (int k = c.among(4) + 2; k > 0; --k) {
    const Vector3d half(c.between(7, 26), c.between(7, 26), c.between(7, 26));
    parts.push_back(block(at - half, at + half));
    at += Vector3d(c.between(-1, 1) * half.x(), c.between(-1, 1) * half.y(), c.between(-1, 1) * half.z());
    at = at.cwiseMax(-25).cwiseMin(25);
  }
  return united(std::move(parts));
}

/// Turned on a lathe, then milled flat on one side and drilled across.
Distance turned_part(Chance& c) {
  std::vector<Vector2d> profile = {{0, -40}};
  double y = -40;
  for (int k = c.among(3) + 3; k > 0; --k) {
    const double radius = c.between(10, 27), next = y + 80.0 / (k + 0.5) * c.between(0.5, 1.0);
    profile.emplace_back(radius, y);
    profile.emplace_back(c.between(0.8, 1.0) * radius, next);
    y = next;
  }
  profile.emplace_back(0, y);
  Distance solid = lathed(std::move(profile));
  if (c.among(2) == 0) {
    const double low = c.between(-35, 0);
    solid = without(std::move(solid), block({c.between(8, 15), low, -40}, {40, low + c.between(15, 35), 40}));
  }
  const Vector3d at(0, c.between(-30, 20), c.between(-8, 8));
  return without(std::move(solid), rod(at, at + 40 * Vector3d::UnitX(), c.between(4, 8)));
}

Distance bracket(Chance& c) {
  const double long_side = c.between(30, 42), short_side = c.between(22, 36), thick = c.between(4, 7),
               half = c.between(14, 26);
  std::vector<Distance> parts = {block({-long_side, -thick, -half}, {long_side, thick, half}),
                                 block({-long_side, -thick, -half}, {-long_side + 2 * thick, short_side * 1.5, half})};
  const double gusset = c.between(-0.6, 0.6) * half;
  parts.push_back(common({block({-long_side, 0, gusset - 3}, {0, short_side, gusset + 3}),
                          half_space(Vector3d(1, 1, 0).normalized(), c.between(-18, -8))}));
  Distance solid = united(std::move(parts));
  for (int k = c.among(2) + 1; k > 0; --k) {
    const Vector3d at(c.between(0.0, 0.8) * long_side, 0, c.between(-0.6, 0.6) * half);
    solid = without(std::move(solid), rod(at - 20 * Vector3d::UnitY(), at + 20 * Vector3d::UnitY(), c.between(3, 6)));
  }
  return solid;
}

Distance ring_with_lug(Chance& c) {
  const double radius = c.between(24, 32), thickness = c.between(6, 10), half = c.between(4, 8);
  const Distance band = ring(Vector3d::Zero(), Vector3d::UnitY(), radius, thickness);
  const Distance lug = block({radius, -half, -half}, {radius + thickness + c.between(4, 14), half, c.between(2, 9)});
  return united({band, lug, ball({-radius * 0.5, c.between(-4, 4), radius * 0.85}, thickness * c.between(1.1, 1.35))});
}

struct Kind {
  const char* name;
  Distance (*draw)(Chance&);
};

constexpr std::array<Kind, 12> kKinds = {{{"bent tube", bent_tube},
                                          {"mug", mug},
                                          {"ribbed box", ribbed_box},
                                          {"plate", plate},
                                          {"wedge", wedge},
                                          {"long thin", long_thin},
                                          {"knot", knot},
                                          {"blob", blob},
                                          {"blocks", blocks},
                                          {"turned part", turned_part},
                                          {"bracket", bracket},
                                          {"ring with lug", ring_with_lug}}};

}  // namespace

double Chance::normal() {  // [Box and Muller 1958]
  const double u = between(1e-12, 1.0), v = between(0.0, 2.0 * std::numbers::pi);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(v);
}

Vector3d Chance::direction() {
  const double x = normal(), y = normal(), z = normal();
  return Vector3d(x, y, z).normalized();
}

int object_kinds() { return static_cast<int>(kKinds.size()); }

void scale_to(Mesh& mesh, double size_mm) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v);
  const float scale = static_cast<float>(size_mm) / box.diagonal().norm();
  for (Eigen::Vector3f& v : mesh.vertices) v = scale * (v - box.center());
}

DrawnObject draw_object(int kind, double size_mm, Chance& chance) {
  const Kind& drawn = kKinds.at(static_cast<std::size_t>(kind));
  DrawnObject object{drawn.name, mesh_of_solid(drawn.draw(chance), kCellMm)};
  scale_to(object.mesh, size_mm);
  return object;
}

}  // namespace scanrig::campaign
