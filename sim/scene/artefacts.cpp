#include "sim/scene/artefacts.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "core/units.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr int kSphereSteps = 480;  // around; half as many from pole to pole: chords 0.3 um inside a ball of 25 mm
constexpr int kRoundSteps = 120;   // of holders
constexpr double kCellMm = 1.5;    // of flat faces: light is computed at vertices

/// A grid of points (columns + 1 by rows + 1) with a vertex each; `at(i, j)` counter-clockwise seen from outside.
template <class At>
void add_grid(TriangleMesh& mesh, int columns, int rows, const At& at) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) mesh.vertices.push_back(at(i, j));
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int a = first + j * (columns + 1) + i, b = a + 1, c = b + columns + 1, d = c - 1;
      for (const auto& t : {Eigen::Vector3i(a, b, c), Eigen::Vector3i(a, c, d)}) {
        const Vector3d& p = mesh.vertices[t[0]];
        // At a pole two corners are one point.
        if ((mesh.vertices[t[1]] - p).cross(mesh.vertices[t[2]] - p).norm() > 1e-12) mesh.triangles.push_back(t);
      }
    }
  }
}

void add_ball(TriangleMesh& mesh, const Vector3d& centre, double radius) {
  constexpr int kRows = kSphereSteps / 2;
  add_grid(mesh, kSphereSteps, kRows, [&](int i, int j) {
    const double along = kTurn * (i % kSphereSteps) / kSphereSteps, up = std::numbers::pi * (j / double{kRows} - 0.5);
    const double across = j == 0 || j == kRows ? 0.0 : std::cos(up);
    return Vector3d(centre + radius * Vector3d(across * std::sin(along), std::sin(up), across * std::cos(along)));
  });
}

/// A cylinder about the line from `from` to `to`, with its ends.
void add_rod(TriangleMesh& mesh, const Vector3d& from, const Vector3d& to, double radius) {
  const Vector3d axis = (to - from).normalized(), x = axis.unitOrthogonal(), z = x.cross(axis);
  const auto rim = [&](int i) {
    const double angle = kTurn * (i % kRoundSteps) / kRoundSteps;
    return Vector3d(radius * (std::sin(angle) * x + std::cos(angle) * z));
  };
  const int rows = std::max(1, static_cast<int>((to - from).norm() / kCellMm));
  add_grid(mesh, kRoundSteps, rows, [&](int i, int j) { return Vector3d(from + (to - from) * j / rows + rim(i)); });
  const int rings = std::max(1, static_cast<int>(radius / kCellMm));
  add_grid(mesh, kRoundSteps, rings, [&](int i, int j) { return Vector3d(to + rim(i) * (rings - j) / rings); });
  add_grid(mesh, kRoundSteps, rings, [&](int i, int j) { return Vector3d(from + rim(i) * j / rings); });
}

/// A box, turned about the x axis through the origin by `lean` (radians), towards -z.
void add_box(TriangleMesh& mesh, const Vector3d& low, const Vector3d& high, double lean = 0.0) {
  const Eigen::AngleAxisd turned(-lean, Vector3d::UnitX());
  const Vector3d size = high - low;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool is_high : {false, true}) {
      const int u = (axis + (is_high ? 1 : 2)) % 3, v = (axis + (is_high ? 2 : 1)) % 3;
      const int columns = std::max(1, static_cast<int>(size[u] / kCellMm));
      const int rows = std::max(1, static_cast<int>(size[v] / kCellMm));
      add_grid(mesh, columns, rows, [&](int i, int j) {
        Vector3d p = is_high ? high : low;
        p[u] = low[u] + size[u] * i / columns;
        p[v] = low[v] + size[v] * j / rows;
        return Vector3d(turned * p);
      });
    }
  }
}

TriangleMesh sphere() {
  TriangleMesh mesh;
  const Vector3d centre(0.0, 45.0, 0.0);
  add_rod(mesh, Vector3d::Zero(), Vector3d(0.0, 6.0, 0.0), 20.0);
  add_rod(mesh, Vector3d(0.0, 6.0, 0.0), centre, 4.0);
  add_ball(mesh, centre, 0.5 * Artefacts::kSphereMm);
  return mesh;
}

TriangleMesh ball_bar() {
  TriangleMesh mesh;
  // As steep as the working volume asks for.
  const double steep = to_radians(40.0);
  const Vector3d middle(0.0, 52.0, 0.0);
  const Vector3d half = 0.5 * Artefacts::kBallBarMm * Vector3d(std::cos(steep), std::sin(steep), 0.0);
  add_rod(mesh, Vector3d::Zero(), Vector3d(0.0, 6.0, 0.0), 20.0);
  add_rod(mesh, Vector3d(0.0, 6.0, 0.0), middle, 5.0);
  add_rod(mesh, middle - half, middle + half, 4.0);
  for (const double side : {-1.0, 1.0}) add_ball(mesh, middle + side * half, 0.5 * Artefacts::kSphereMm);
  return mesh;
}

TriangleMesh plane() {
  TriangleMesh mesh;
  constexpr double kHalf = 0.5 * Artefacts::kPlaneWidthMm, kInFoot = 8.0;
  const double lean = to_radians(15.0);
  add_box(mesh, {-kHalf, 0.0, -25.0}, {kHalf, 12.0, 25.0});
  add_box(mesh, {-kHalf, kInFoot, -8.0}, {kHalf, 12.0 + Artefacts::kPlaneHeightMm, 0.0}, lean);
  return mesh;
}

TriangleMesh step_gauge() {
  TriangleMesh mesh;
  constexpr double kTread = 20.0, kHalfWidth = 30.0, kBack = -22.0, kLowest = -7.0;
  const auto& heights = Artefacts::kStepHeightsMm;
  constexpr int kSteps = static_cast<int>(std::size(Artefacts::kStepHeightsMm));
  // The highest step stands in front, at the foot, and hides no other from cameras above.
  for (int k = 0; k <= kSteps; ++k) {
    const double height = k == kSteps ? 0.0 : heights[kSteps - 1 - k];
    add_box(mesh, {-kHalfWidth, 0.0, kBack}, {kHalfWidth, kTread * (k + 1), kLowest + height});
  }
  return mesh;
}

struct Named {
  std::string_view name;
  TriangleMesh (*make)();
};

constexpr std::array<Named, 4> kArtefacts{
    {{"sphere", sphere}, {"ball-bar", ball_bar}, {"plane", plane}, {"step-gauge", step_gauge}}};

}  // namespace

std::optional<TriangleMesh> artefact(std::string_view name) {
  for (const Named& one : kArtefacts) {
    if (one.name == name) return one.make();
  }
  return std::nullopt;
}

}  // namespace scanrig::sim
