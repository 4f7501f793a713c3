#include "sim/scene/rests.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/parallel.h"
#include "core/units.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;  // extreme vertices relative to the centre of mass

constexpr int kDrops = 600;

Vector3d random_direction(std::uint64_t bits) {
  const double y = 2.0 * uniform(bits) - 1.0, phi = 2.0 * std::numbers::pi * uniform(mix(bits));
  const double r = std::sqrt(1.0 - y * y);
  return {r * std::cos(phi), y, r * std::sin(phi)};
}

int lowest(const Points& points, const Vector3d& down) {
  int best = 0;
  for (int i = 1; i < static_cast<int>(points.size()); ++i) {
    if (down.dot(points[i]) > down.dot(points[best])) best = i;
  }
  return best;
}

double height(const Points& points, const Vector3d& down) { return down.dot(points[lowest(points, down)]); }

struct Touch {
  double slope = 1e300;  ///< tangent of the angle to turn until the point touches
  int point = -1;
};

/// Turns `down` towards `side` (unit, perpendicular to it) about the contact `pivot`; returns the point that touches
/// next.
Touch next_touch(const Points& points, const Vector3d& pivot, const Vector3d& down, const Vector3d& side,
                 const std::vector<int>& contacts) {
  Touch first;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    if (std::find(contacts.begin(), contacts.end(), i) != contacts.end()) continue;
    const Vector3d d = points[i] - pivot;
    const double sink = side.dot(d);
    if (sink <= 1e-9) continue;
    const double slope = -down.dot(d) / sink;  // gap above the plane over how fast it closes
    if (slope < first.slope) first = {slope, i};
  }
  return first;
}

/// Direction in which turning `down` sinks the centre of mass fastest while `contacts` stay down, or nothing.
std::optional<Vector3d> rolling_side(const Points& points, const Vector3d& down, const std::vector<int>& contacts) {
  const Vector3d& pivot = points[contacts[0]];
  // The height is down . pivot; turning towards `side` changes it by side . pivot per radian.
  Vector3d side = -(pivot - down.dot(pivot) * down);
  if (contacts.size() == 2) {
    const Vector3d axis = (points[contacts[1]] - pivot).normalized();
    side -= axis.dot(side) * axis;
  }
  const double size = side.norm();
  if (size < 1e-9) return std::nullopt;
  return side / size;
}

/// Of three contacts, keeps the two over whose edge the centre of mass hangs, if there is such an edge.
bool drop_one_contact(const Points& points, const Vector3d& down, std::vector<int>& contacts) {
  for (int i = 0; i < 3; ++i) {
    const Vector3d &a = points[contacts[i]], &b = points[contacts[(i + 1) % 3]], &c = points[contacts[(i + 2) % 3]];
    const Vector3d across = (b - a).cross(down);
    // The centre of mass is the origin; it hangs over if it is on the other side of the edge than the third contact.
    if (across.dot(-a) * across.dot(c - a) < 0.0) {
      contacts = {contacts[i], contacts[(i + 1) % 3]};
      return true;
    }
  }
  return false;
}

Vector3d roll(const Points& points, Vector3d down) {
  std::vector<int> contacts = {lowest(points, down)};
  constexpr int kMaxSteps = 3000;
  for (int step = 0; step < kMaxSteps; ++step) {
    if (contacts.size() == 3 && !drop_one_contact(points, down, contacts)) return down;
    const auto side = rolling_side(points, down, contacts);
    if (!side) return down;
    const Vector3d& pivot = points[contacts[0]];
    const Touch touch = next_touch(points, pivot, down, *side, contacts);
    // The lowest point of the arc: the centre of mass straight above the pivot (or the edge).
    const double bottom = std::atan2(-side->dot(pivot), down.dot(pivot));
    const double touching = std::atan(touch.slope);
    const double angle = std::clamp(touching, 0.0, bottom);
    down = (std::cos(angle) * down + std::sin(angle) * *side).normalized();
    if (touch.point < 0 || touching > bottom) return down;
    contacts.push_back(touch.point);
  }
  return down;
}

/// A tilt of two degrees any way lifts the centre of mass, and by more than the facets of a round body would.
bool is_firm(const Points& points, const Vector3d& down) {
  const double tilt = to_radians(2.0), at_rest = height(points, down);
  constexpr double kMinLift = 1e-3;  // of the height of the centre of mass
  const Vector3d side = down.unitOrthogonal(), other = down.cross(side);
  for (int i = 0; i < 24; ++i) {
    const double phi = 2.0 * std::numbers::pi * i / 24;
    const Vector3d tilted = std::cos(tilt) * down + std::sin(tilt) * (std::cos(phi) * side + std::sin(phi) * other);
    if (height(points, tilted) < (1.0 + kMinLift) * at_rest) return false;
  }
  return true;
}

double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Draws by chance among the rests that `allowed` accepts; -1: no rest.
template <class Allowed>
int draw(const std::vector<Rest>& rests, double random, const Allowed& allowed) {
  // Every firm rest is drawn now and then, however seldom a drop would end there.
  constexpr double kMinChance = 0.03;
  const auto weight = [&](const Rest& r) { return allowed(r) ? std::max(r.chance, kMinChance) : 0.0; };
  double total = 0.0;
  for (const auto& r : rests) total += weight(r);
  int last = -1;
  double left = random * total;
  for (int i = 0; i < static_cast<int>(rests.size()); ++i) {
    if (weight(rests[i]) <= 0.0) continue;
    last = i;
    left -= weight(rests[i]);
    if (left < 0.0) break;
  }
  return last;
}

Result<Transform> put_down(const TriangleMesh& mesh, const Vector3d& down, std::uint64_t seed, bool any_size) {
  const Profile& p = profile();
  Transform table_from_object = rot_y(2.0 * std::numbers::pi * uniform(mix(seed, 1))) *
                                Transform(Eigen::Quaterniond::FromTwoVectors(down, -Vector3d::UnitY()));
  double low = 1e300, high = -1e300;
  std::vector<Vector2d> plan;
  for (const auto& v : mesh.vertices) {
    const Vector3d q = table_from_object * v;
    low = std::min(low, q.y()), high = std::max(high, q.y());
    plan.emplace_back(q.x(), q.z());
  }
  const Circle circle = smallest_circle(plan);
  if (!any_size && (2.0 * circle.radius > p.largest_diameter_mm || high - low > p.largest_height_mm)) {
    return fail(
        ErrorCode::invalid_input,
        "object: larger than the working volume ({:.0f} mm across and {:.0f} mm high in one of its rests, {:.0f} "
        "and {:.0f} fit): choose a smaller height",
        2.0 * circle.radius, high - low, p.largest_diameter_mm, p.largest_height_mm);
  }
  const double offset = 3.0 * std::sqrt(uniform(mix(seed, 2))), phi = 2.0 * std::numbers::pi * uniform(mix(seed, 3));
  table_from_object.pretranslate(
      Vector3d(offset * std::cos(phi) - circle.centre.x(), -low, offset * std::sin(phi) - circle.centre.y()));
  return table_from_object;
}

}  // namespace

std::vector<Rest> stable_rests(const TriangleMesh& mesh, std::uint64_t seed) {
  const Vector3d centre = centre_of_mass(mesh);
  Points points = extreme_vertices(mesh.vertices);
  for (auto& p : points) p -= centre;
  std::vector<Vector3d> ends(kDrops);
  parallel_for(kDrops, [&](std::size_t i) { ends[i] = roll(points, random_direction(mix(seed, 17, i))); });
  std::vector<Rest> rests;
  for (const auto& down : ends) {
    const auto same = [&](const Rest& r) { return angle_between(r.down, down) < to_radians(3.0); };
    const auto known = std::find_if(rests.begin(), rests.end(), same);
    if (known != rests.end()) {
      known->chance += 1.0 / kDrops;
    } else {
      rests.push_back({down, height(points, down), 1.0 / kDrops});
    }
  }
  std::erase_if(rests, [&](const Rest& r) { return !is_firm(points, r.down); });
  std::stable_sort(rests.begin(), rests.end(), [](const Rest& a, const Rest& b) { return a.chance > b.chance; });
  return rests;
}

Result<std::vector<Transform>> draw_placements(const TriangleMesh& mesh, std::uint64_t seed, int count, bool same_rest,
                                               bool any_size) {
  const auto rests = stable_rests(mesh, seed);
  std::vector<int> drawn = {draw(rests, uniform(mix(seed, 4)), [](const Rest&) { return true; })};
  const auto turned_over = [&](const Rest& rest) {
    return std::ranges::all_of(drawn,
                               [&](int d) { return angle_between(rest.down, rests[d].down) > to_radians(30.0); });
  };
  for (int i = 1; i < std::max(count, 2) && drawn.front() >= 0 && !same_rest; ++i) {
    const std::uint64_t key = i == 1 ? mix(seed, 5) : mix(seed, 5, i);
    const int next = draw(rests, uniform(key), turned_over);
    if (next < 0) break;
    drawn.push_back(next);
  }
  if (drawn.front() < 0 || (drawn.size() < 2 && !same_rest)) {
    return fail(ErrorCode::degenerate, "object: it has {} stable rest(s) on a table, two are needed", rests.size());
  }
  std::vector<Transform> placements;
  for (int i = 0; i < count; ++i) {
    const Rest& rest = rests[drawn[static_cast<std::size_t>(i) % drawn.size()]];
    const auto placed = put_down(mesh, rest.down, mix(seed, 6, i), any_size);
    if (!placed) return pass_on(placed);
    placements.push_back(*placed);
  }
  return placements;
}

Result<std::vector<Transform>> upright_placements(const TriangleMesh& mesh, std::uint64_t seed, int count,
                                                  bool any_size) {
  std::vector<Transform> placements;
  for (int i = 0; i < count; ++i) {
    const auto placed = put_down(mesh, -Vector3d::UnitY(), mix(seed, 6, i), any_size);
    if (!placed) return pass_on(placed);
    placements.push_back(*placed);
  }
  return placements;
}

}  // namespace scanrig::sim
