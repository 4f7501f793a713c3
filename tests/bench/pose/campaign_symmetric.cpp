#include "tests/bench/pose/campaign_symmetric.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "pipeline/mesh/solid_properties.h"

namespace scanrig::campaign {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kAround = 240;     // points of a section: 2, 3, 4, 5, 6 and 8 corners fall onto some of them
constexpr double kStepMm = 1.5;  // between rings
constexpr double kBumpWidthMm = 14.0;

/// Points around the axis, counter-clockwise from above: (x, -z).
using Section = std::vector<Vector2d>;

template <typename Radius>
Section round_section(Radius radius) {
  Section section;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kAround;
    section.push_back(radius(angle) * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return section;
}

Section circle() {
  return round_section([](double) { return 1.0; });
}

/// A polygon whose inscribed circle has the radius 1.
Section polygon(int corners) {
  const double part = 2.0 * std::numbers::pi / corners;
  return round_section([=](double angle) { return 1.0 / std::cos(std::fmod(angle, part) - 0.5 * part); });
}

Section lobes(int count, double height) {
  return round_section([=](double angle) { return 1.0 + height * std::cos(count * angle); });
}

/// A square seen from above, as wide as twice these.
Section rectangle(double half_x, double half_z) {
  Section section = polygon(4);
  const Eigen::Rotation2Dd upright(-0.25 * std::numbers::pi);
  for (Vector2d& p : section) p = (upright * p).cwiseProduct(Vector2d(half_x, half_z));
  return section;
}

/// One step of the way from the middle of the base to the middle of the top.
struct Ring {
  double radius, height;
  double share = 0.0;  ///< of the second section; the rest is the first one's
};

std::vector<Ring> in_steps(const std::vector<Ring>& rings) {
  std::vector<Ring> all = {rings[0]};
  for (std::size_t i = 1; i < rings.size(); ++i) {
    const Ring &a = rings[i - 1], &b = rings[i];
    const int steps = std::max(1, static_cast<int>(std::hypot(b.radius - a.radius, b.height - a.height) / kStepMm));
    for (int k = 1; k <= steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      all.push_back({a.radius + t * (b.radius - a.radius), a.height + t * (b.height - a.height),
                     a.share + t * (b.share - a.share)});
    }
  }
  return all;
}

/// The closed surface of sections along the y axis, with a fan at either end.
Mesh swept(const std::vector<Ring>& way, const Section& first, const Section& second) {
  const std::vector<Ring> rings = in_steps(way);
  Mesh mesh;
  for (const Ring& ring : rings) {
    for (int i = 0; i < kAround; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const Vector2d at = ring.radius * ((1.0 - ring.share) * first[n] + ring.share * second[n]);
      mesh.vertices.emplace_back(Vector3d(at.x(), ring.height, -at.y()).cast<float>());
    }
  }
  const auto vertex = [](std::size_t ring, int i) {
    return static_cast<std::uint32_t>(ring * kAround + static_cast<std::size_t>(i % kAround));
  };
  for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
    for (int i = 0; i < kAround; ++i) {
      mesh.faces.push_back({vertex(ring, i), vertex(ring, i + 1), vertex(ring + 1, i + 1)});
      mesh.faces.push_back({vertex(ring, i), vertex(ring + 1, i + 1), vertex(ring + 1, i)});
    }
  }
  for (const auto& [ring, is_top] : {std::pair{std::size_t{0}, false}, {rings.size() - 1, true}}) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.emplace_back(0.0F, static_cast<float>(rings[ring].height), 0.0F);
    for (int i = 0; i < kAround; ++i) {
      if (is_top) mesh.faces.push_back({middle, vertex(ring, i), vertex(ring, i + 1)});
      if (!is_top) mesh.faces.push_back({middle, vertex(ring, i + 1), vertex(ring, i)});
    }
  }
  return mesh;
}

Mesh swept(const std::vector<Ring>& way, const Section& section) { return swept(way, section, section); }

Mesh upright(const Section& section, double height) { return swept({{1, 0}, {1, height}}, section); }

Mesh ball() {
  std::vector<Ring> way;
  constexpr int kSteps = 120;
  for (int k = 1; k < kSteps; ++k) {
    const double angle = std::numbers::pi * k / kSteps;
    way.push_back({40.0 * std::sin(angle), -40.0 * std::cos(angle)});
  }
  return swept(way, circle());
}

Mesh bottle(Chance& c) {
  const double body = c.between(17, 25), neck = c.between(0.35, 0.6) * body, shoulder = c.between(36, 52);
  return swept({{body - 2, 0},
                {body, 2},
                {body, shoulder},
                {0.5 * (body + neck) + 2, shoulder + 8},
                {neck, shoulder + 14},
                {neck, shoulder + c.between(22, 34)}},
               circle());
}

/// Hollow, its wall in waves.
Mesh vase(Chance& c) {
  const double foot = c.between(14, 20), wave = c.between(3, 6), phase = c.between(0, 3), wall = c.between(4, 6),
               height = c.between(55, 70), floor = c.between(5, 9);
  const auto radius = [=](double y) { return foot + 4.0 + wave * std::sin(phase + 5.0 * y / height); };
  std::vector<Ring> way;
  for (double y = 0.0; y <= height; y += kStepMm) way.push_back({radius(y), y});
  const double top = way.back().height;
  for (double y = top; y >= floor; y -= kStepMm) way.push_back({radius(y) - wall, y});
  return swept(way, circle());
}

Mesh spool(Chance& c) {
  const double core = c.between(9, 16), flange = core + c.between(6, 14), thick = c.between(5, 9),
               height = c.between(35, 60);
  return swept(
      {{flange, 0}, {flange, thick}, {core, thick}, {core, height - thick}, {flange, height - thick}, {flange, height}},
      circle());
}

Mesh cone(Chance& c) {
  const double foot = c.between(22, 30);
  return swept({{foot, 0}, {foot, c.between(3, 8)}, {c.between(6, 12), c.between(45, 60)}}, circle());
}

Mesh box(Chance& c) {
  const double x = c.between(28, 36), z = c.between(18, 24);
  return upright(rectangle(x, z), c.between(20, 30));
}

Mesh square_block(Chance& c) {
  const double half = c.between(18, 26);
  return upright(rectangle(half, half), c.among(2) == 0 ? c.between(0.8, 1.3) * half : c.between(2.6, 3.4) * half);
}

Mesh wing_screw(Chance& c) {
  const double shaft = c.between(9, 13), length = c.between(24, 34), head = c.between(16, 24);
  return swept({{shaft, 0}, {shaft, length}, {shaft, length + 4, 1}, {shaft, length + head, 1}}, circle(),
               lobes(2, c.between(0.5, 0.7)));
}

Mesh knob(int count, Chance& c) {
  const double shaft = c.between(12, 17), length = c.between(10, 26), head = c.between(14, 22),
               wide = shaft + c.between(8, 14);
  return swept(
      {{shaft, 0}, {shaft, length}, {wide, length, 1}, {wide, length + head - 4, 1}, {wide - 4, length + head, 1}},
      circle(), lobes(count, c.between(0.1, 0.18)));
}

/// A prism of which one end is narrower.
Mesh capped(int corners, Chance& c) {
  const double radius = c.between(18, 24), height = c.between(22, 40);
  return swept({{radius, 0}, {radius, height}, {c.between(0.4, 0.7) * radius, height + c.between(8, 18)}},
               polygon(corners));
}

Mesh prism(int corners, Chance& c) {
  const double radius = c.between(17, 25);
  return swept({{radius, 0}, {radius, c.between(1.1, 2.6) * radius}}, polygon(corners));
}

Mesh cylinder(Chance& c) {
  const double radius = c.between(16, 26);
  return swept({{radius, 0}, {radius, c.between(0.7, 3.0) * radius}}, circle());
}

constexpr int kMug = 1;  // of object_kinds()

struct Kind {
  const char *name, *group;
  int fold;
  Mesh (*draw)(Chance&);
};

constexpr std::array<Kind, 20> kKinds = {{
    {"box", "dihedral", 2, box},
    {"square block", "dihedral", 4, square_block},
    {"prism of 6", "dihedral", 6, [](Chance& c) { return prism(6, c); }},
    {"cylinder", "axial", 0, cylinder},
    {"prism of 3", "dihedral", 3, [](Chance& c) { return prism(3, c); }},  // up to here: bumped ones, too
    {"cube", "cubic", 4, [](Chance&) { return upright(rectangle(20, 20), 40); }},
    {"prism of 5", "dihedral", 5, [](Chance& c) { return prism(5, c); }},
    {"prism of 8", "dihedral", 8, [](Chance& c) { return prism(8, c); }},
    {"ball", "spherical", 0, [](Chance&) { return ball(); }},
    {"bottle", "axial", 0, bottle},
    {"vase", "axial", 0, vase},
    {"spool", "axial", 0, spool},
    {"cone", "axial", 0, cone},
    {"cap of 4", "cyclic", 4, [](Chance& c) { return capped(4, c); }},
    {"cap of 6", "cyclic", 6, [](Chance& c) { return capped(6, c); }},
    {"wing screw", "cyclic", 2, wing_screw},
    {"knob of 3", "cyclic", 3, [](Chance& c) { return knob(3, c); }},
    {"knob of 5", "cyclic", 5, [](Chance& c) { return knob(5, c); }},
    {"knob of 6", "cyclic", 6, [](Chance& c) { return knob(6, c); }},
    {"mug", "none", 1, [](Chance& c) { return draw_object(kMug, 100.0, c).mesh; }},
}};
constexpr int kBumpedKinds = 5;

/// Raises a cap around a vertex of the sides, away from edges.
void raise_bump(double height_mm, Mesh& mesh, Chance& chance) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v);
  const std::vector<Eigen::Vector3f> normals = vertex_normals(mesh);
  std::size_t foot = 0;
  const auto is_on_a_side = [&](std::size_t v) {
    const float share = (mesh.vertices[v].y() - box.min().y()) / box.sizes().y();
    return share > 0.3F && share < 0.7F && std::abs(normals[v].y()) < 0.1F;
  };
  do {
    foot = static_cast<std::size_t>(chance.among(static_cast<int>(mesh.vertices.size())));
  } while (!is_on_a_side(foot));
  const Eigen::Vector3f at = mesh.vertices[foot], up = normals[foot];
  for (Eigen::Vector3f& v : mesh.vertices) {
    const float away = 2.0F * (v - at).norm() / static_cast<float>(kBumpWidthMm);
    if (away < 1.0F) v += static_cast<float>(height_mm) * (1.0F - away * away) * up;
  }
}

}  // namespace

int symmetric_kinds() { return static_cast<int>(kKinds.size()); }

int bumped_kind(int number) { return number % kBumpedKinds; }

SymmetricObject draw_symmetric(int kind, double size_mm, double bump_mm, Chance& chance) {
  const Kind& drawn = kKinds.at(static_cast<std::size_t>(kind));
  SymmetricObject object{{drawn.name, drawn.draw(chance)}, drawn.group, drawn.fold};
  scale_to(object.drawn.mesh, size_mm);
  if (bump_mm > 0.0) raise_bump(bump_mm, object.drawn.mesh, chance);
  return object;
}

}  // namespace scanrig::campaign
