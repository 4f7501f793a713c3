#include "sim/scene/figurine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sim/scene/polygonise.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Distance functions, mm, negative inside; exact or slightly short of the true distance.

double capsule(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius_a, double radius_b) {
  const Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm() - (radius_a + t * (radius_b - radius_a));
}

/// First-order distance to an ellipsoid.
double ellipsoid(const Vector3d& p, const Vector3d& centre, const Vector3d& radii) {
  const Vector3d q = (p - centre).cwiseQuotient(radii);
  const double length = q.norm();
  const double gradient = q.cwiseQuotient(radii).norm();
  return gradient > 1e-9 ? length * (length - 1.0) / gradient : -radii.minCoeff();
}

/// A disc of `radius` and `thickness` about an axis, its rim rounded.
double disc(const Vector3d& p, const Vector3d& centre, const Vector3d& axis, double radius, double thickness) {
  const Vector3d q = p - centre;
  const double h = q.dot(axis);
  const double r = (q - h * axis).norm();
  const double round = 0.5 * thickness;
  return Vector2d(std::max(r - (radius - round), 0.0), h).norm() - round;
}

/// Smallest of two distances, blended over `k` mm.
double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * h * h * k;
}

double plinth(const Vector3d& p) {
  // An oval slab with rounded edges, flat below, hollowed from underneath.
  const double side = ellipsoid({p.x(), 0.0, p.z()}, {1.0, 0.0, -1.0}, {27.0, 1.0, 23.0});
  const double level = std::abs(p.y() - 6.0) - 6.0;
  constexpr double kRound = 2.0;
  const Vector2d d(side + kRound, level + kRound);
  const double slab = d.cwiseMax(0.0).norm() + std::min(d.maxCoeff(), 0.0) - kRound;
  const double hollow = ellipsoid(p, {3.0, -2.0, 0.0}, {17.0, 11.5, 13.0});
  return -smooth_min(-slab, hollow, 2.0);
}

double body(const Vector3d& p) {
  const double torso = ellipsoid(p, {-1.0, 34.0, -1.0}, {18.0, 24.0, 15.0});
  const double belly = ellipsoid(p, {3.0, 28.0, 9.0}, {12.0, 13.0, 10.0});
  // Ribs of a knitted coat, faded out at neck and foot.
  const double fade = std::clamp((p.y() - 15.0) / 6.0, 0.0, 1.0) * std::clamp((52.0 - p.y()) / 6.0, 0.0, 1.0);
  const double ribs = 0.35 * fade * std::sin(p.y() * 0.85 + 0.12 * p.x()) * std::sin(0.72 * p.x() - 0.5 * p.z());
  return smooth_min(torso, belly, 6.0) + ribs;
}

double head(const Vector3d& p) {
  const double skull = ellipsoid(p, {3.0, 68.0, 2.0}, {13.0, 14.0, 12.5});
  const double nose = capsule(p, {4.0, 67.0, 12.0}, {5.0, 64.5, 19.0}, 3.2, 2.2);
  const double ear = ellipsoid(p, {-10.5, 67.0, 0.0}, {4.0, 5.5, 2.6});
  const double face = smooth_min(smooth_min(skull, nose, 2.5), ear, 2.0);
  const double eye = std::min((p - Vector3d(-1.2, 70.5, 13.6)).norm(), (p - Vector3d(9.0, 70.5, 12.6)).norm()) - 2.0;
  return -smooth_min(-face, eye, 1.5);
}

double hat(const Vector3d& p) {
  static const Vector3d axis = Vector3d(0.22, 1.0, -0.14).normalized();
  const double brim = disc(p, {4.0, 79.0, 1.0}, axis, 21.0, 2.6);
  const double crown = ellipsoid(p, {6.0, 84.0, 0.0}, {11.0, 16.0, 10.0});
  const double feather = capsule(p, {14.5, 84.0, -3.0}, {19.0, 96.0, -9.0}, 2.2, 1.3);
  return smooth_min(smooth_min(brim, crown, 3.0), feather, 1.5);
}

double limbs(const Vector3d& p) {
  const double upper = capsule(p, {14.0, 48.0, 0.0}, {31.0, 42.0, 7.0}, 5.0, 4.2);
  const double lower = capsule(p, {31.0, 42.0, 7.0}, {37.0, 58.0, 14.0}, 4.2, 3.4);
  const double hand = ellipsoid(p, {37.5, 61.0, 15.0}, {4.6, 5.2, 3.6});
  const double right = smooth_min(smooth_min(upper, lower, 1.5), hand, 2.0);
  const double left = capsule(p, {-14.0, 47.0, 2.0}, {-29.0, 33.0, 12.0}, 5.0, 4.0);
  const double tail_root = capsule(p, {-4.0, 22.0, -12.0}, {-10.0, 20.0, -30.0}, 3.4, 2.2);
  const double tail_tip = capsule(p, {-10.0, 20.0, -30.0}, {-16.0, 38.0, -37.0}, 2.2, 1.5);
  return std::min(std::min(right, left), smooth_min(tail_root, tail_tip, 1.5));
}

double figure(const Vector3d& p) {
  const double lower = smooth_min(plinth(p), body(p), 4.0);
  const double upper = smooth_min(head(p), hat(p), 2.0);
  return smooth_min(smooth_min(lower, upper, 4.0), limbs(p), 3.0);
}

}  // namespace

TriangleMesh figurine(double cell) {
  // The ellipsoids' first-order distances steepen to about twice a true distance well inside.
  constexpr double kSteepness = 2.5;
  TriangleMesh mesh = polygonise(figure, {{-50.0, -3.1, -50.0}, {50.0, 106.0, 50.0}}, cell, kSteepness);
  double low = 1e300, high = -1e300;
  for (const auto& v : mesh.vertices) low = std::min(low, v.y()), high = std::max(high, v.y());
  for (auto& v : mesh.vertices) v = Vector3d(v.x(), v.y() - low, v.z()) * (100.0 / (high - low));
  return mesh;
}

}  // namespace scanrig::sim
