#include "sim/scene/fixture.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/units.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

constexpr double kLiftMm = 8.0;  // of the object's lowest point
constexpr double kSunkMm = 5.0;  // putty above that
constexpr double kPuttyMm[] = {14.0, 11.0};
constexpr double kPinRadiusMm = 2.5, kPinsOutMm = 9.0, kPinSunkMm = 1.0, kLongestPinMm = 45.0;
constexpr int kAround = 48, kRings = 16;

enum class FixtureRandom : std::uint8_t { tilt = 110, direction, turn };

/// A closed body of rings of `kAround` vertices, lowest first, between two poles.
void add_rings(const std::vector<std::vector<Vector3d>>& rings, const Vector3d& bottom, const Vector3d& top,
               TriangleMesh& mesh) {
  const int first = static_cast<int>(mesh.vertices.size()), count = static_cast<int>(rings.size());
  for (const auto& ring : rings) mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  mesh.vertices.push_back(bottom);
  mesh.vertices.push_back(top);
  const int low_pole = first + count * kAround, high_pole = low_pole + 1;
  for (int k = 0; k < kAround; ++k) {
    const int next = (k + 1) % kAround;
    mesh.triangles.emplace_back(low_pole, first + k, first + next);
    for (int r = 0; r + 1 < count; ++r) {
      const int a = first + r * kAround, b = a + kAround;
      mesh.triangles.emplace_back(a + k, b + k, b + next);
      mesh.triangles.emplace_back(a + k, b + next, a + next);
    }
    const int last = first + (count - 1) * kAround;
    mesh.triangles.emplace_back(high_pole, last + next, last + k);
  }
}

std::vector<Vector3d> ring_at(const Vector3d& centre, double along_x, double along_z) {
  std::vector<Vector3d> ring;
  for (int k = 0; k < kAround; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kAround;
    ring.emplace_back(centre + Vector3d(along_x * std::cos(angle), 0.0, along_z * std::sin(angle)));
  }
  return ring;
}

TriangleMesh putty_at(const Vector3d& foot, double height) {
  std::vector<std::vector<Vector3d>> rings;
  for (int r = 0; r < kRings; ++r) {
    const double angle = 0.5 * std::numbers::pi * r / kRings;
    rings.push_back(ring_at(foot + height * std::sin(angle) * Vector3d::UnitY(), kPuttyMm[0] * std::cos(angle),
                            kPuttyMm[1] * std::cos(angle)));
  }
  TriangleMesh mesh;
  add_rings(rings, foot, foot + height * Vector3d::UnitY(), mesh);
  return mesh;
}

/// Under what lies above three places of the table.
Result<TriangleMesh> pins_at(const TriangleMesh& mesh, const RayCaster& rays, const Transform& table_from_object,
                             const Vector3d& foot, double turn) {
  const Transform object_from_table = table_from_object.inverse();
  TriangleMesh pins;
  for (int k = 0; k < 3; ++k) {
    const double angle = turn + 2.0 * std::numbers::pi * k / 3;
    for (double out = kPinsOutMm; out > 0.0; out -= 2.0) {
      const Vector3d at = foot + out * Vector3d(std::cos(angle), 0.0, std::sin(angle));
      const Vector3d up = object_from_table.linear() * Vector3d::UnitY();
      const auto hit = rays.first_hit(object_from_table * at, up);
      if (hit.triangle < 0) continue;
      const Eigen::Vector3i& t = mesh.triangles[static_cast<std::size_t>(hit.triangle)];
      const Vector3d point =
          (1.0 - hit.u - hit.v) * mesh.vertices[t[0]] + hit.u * mesh.vertices[t[1]] + hit.v * mesh.vertices[t[2]];
      const double height = (table_from_object * point).y() + kPinSunkMm;
      if (height > kLongestPinMm) continue;
      const Vector3d top = at + height * Vector3d::UnitY();
      add_rings({ring_at(at, kPinRadiusMm, kPinRadiusMm), ring_at(top, kPinRadiusMm, kPinRadiusMm)}, at, top, pins);
      break;
    }
  }
  if (pins.triangles.empty()) return fail(ErrorCode::degenerate, "fixture: no pin meets the object");
  return pins;
}

/// Of the object, then of the fixture.
class HeldColour final : public SurfaceColour {
 public:
  HeldColour(std::shared_ptr<const SurfaceColour> object, int triangles)
      : object_(std::move(object)), fixture_(stone_colour()), triangles_(triangles) {}
  [[nodiscard]] Eigen::Vector3f albedo(const SurfacePoint& point) const override {
    return point.triangle < triangles_ ? object_->albedo(point) : fixture_->albedo(point);
  }

 private:
  std::shared_ptr<const SurfaceColour> object_;
  std::unique_ptr<SurfaceColour> fixture_;
  int triangles_;
};

}  // namespace

Result<HeldObject> hold(const TriangleMesh& mesh, const RayCaster& rays, const Transform& placement, FixtureKind kind,
                        std::uint64_t seed) {
  HeldObject held;
  held.table_from_object = placement;
  if (kind == FixtureKind::none) return held;
  const double tilt = to_radians(8.0 + 17.0 * uniform(mix(seed, FixtureRandom::tilt)));
  const double direction = 2.0 * std::numbers::pi * uniform(mix(seed, FixtureRandom::direction));
  const Eigen::AngleAxisd lean(tilt, Vector3d(std::cos(direction), 0.0, std::sin(direction)));
  held.table_from_object = lean * placement;
  Vector3d lowest(0.0, std::numeric_limits<double>::infinity(), 0.0);
  for (const Vector3d& v : mesh.vertices) {
    const Vector3d p = held.table_from_object * v;
    if (p.y() < lowest.y()) lowest = p;
  }
  held.table_from_object.pretranslate(Vector3d(0.0, kLiftMm - lowest.y(), 0.0));
  const Vector3d foot(lowest.x(), 0.0, lowest.z());
  if (kind == FixtureKind::putty) {
    held.fixture = putty_at(foot, kLiftMm + kSunkMm);
  } else {
    const double turn = 2.0 * std::numbers::pi * uniform(mix(seed, FixtureRandom::turn));
    auto pins = pins_at(mesh, rays, held.table_from_object, foot, turn);
    if (!pins) return pass_on(pins);
    held.fixture = std::move(*pins);
  }
  const Transform object_from_table = held.table_from_object.inverse();
  for (Vector3d& v : held.fixture.vertices) v = object_from_table * v;
  return held;
}

Object with_fixture(const Object& object, const TriangleMesh& fixture) {
  Object both = object;
  const int first = static_cast<int>(object.mesh.vertices.size());
  both.colour = std::make_shared<HeldColour>(object.colour, static_cast<int>(object.mesh.triangles.size()));
  both.mesh.vertices.insert(both.mesh.vertices.end(), fixture.vertices.begin(), fixture.vertices.end());
  for (const Eigen::Vector3i& t : fixture.triangles) both.mesh.triangles.emplace_back((t.array() + first).matrix());
  const auto normals = vertex_normals(fixture);
  both.normals.insert(both.normals.end(), normals.begin(), normals.end());
  return both;
}

}  // namespace scanrig::sim
