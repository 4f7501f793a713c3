#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/pipeline/registration/analytic_views.h"

/// Symmetric solids, standing on y = 0 with their axis upright; signed distances as of analytic_views.h.
namespace scanrig::testing {

/// The solid that the closed polygon `profile` (radius, height) sweeps about the y axis.
inline Solid lathed(std::vector<Eigen::Vector2d> profile) {
  return [profile = std::move(profile)](const Eigen::Vector3d& p) {
    const Eigen::Vector2d q(std::hypot(p.x(), p.z()), p.y());
    double nearest = std::numeric_limits<double>::infinity();
    bool inside = false;
    for (std::size_t i = 0; i < profile.size(); ++i) {
      const Eigen::Vector2d& a = profile[i];
      const Eigen::Vector2d& b = profile[(i + 1) % profile.size()];
      if ((a.y() > q.y()) != (b.y() > q.y()) && q.x() < a.x() + (b.x() - a.x()) * (q.y() - a.y()) / (b.y() - a.y())) {
        inside = !inside;
      }
      if (a.x() <= 0.0 && b.x() <= 0.0) continue;  // the axis is no surface
      const Eigen::Vector2d edge = b - a;
      const double t = std::clamp((q - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (q - a - t * edge).norm());
    }
    return inside ? -nearest : nearest;
  };
}

inline Solid bottle() {
  return lathed({{0, 0}, {20, 0}, {22, 2}, {22, 40}, {20, 46}, {15, 52}, {11, 57}, {10, 62}, {10, 72}, {0, 72}});
}

inline Solid vase() {
  return lathed(
      {{0, 0}, {14, 0}, {18, 6}, {22, 14}, {23, 22}, {21, 32}, {16, 42}, {13, 50}, {14, 58}, {17, 64}, {0, 64}});
}

/// A prism over a regular polygon; `radius` of its inscribed circle.
inline Solid prism(int sides, double radius, double height) {
  return [=](const Eigen::Vector3d& p) {
    double outside = std::abs(p.y() - 0.5 * height) - 0.5 * height;
    for (int k = 0; k < sides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / sides;
      outside = std::max(outside, p.x() * std::cos(angle) + p.z() * std::sin(angle) - radius);
    }
    return outside;
  };
}

/// A ring about the z direction through `centre`.
inline Solid ring(const Eigen::Vector3d& centre, double radius, double thickness) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = p - centre;
    return std::hypot(std::hypot(q.x(), q.y()) - radius, q.z()) - thickness;
  };
}

/// A body of revolution with a handle: no symmetry but a mirror's.
inline Solid mug() { return together({upright_cylinder({0, 0, 0}, 24, 56), ring({26, 30, 0}, 14, 4)}); }

/// `solid` with a low cap of this height and width on a face with this normal.
inline Solid with_bump(const Solid& solid, const Eigen::Vector3d& foot, const Eigen::Vector3d& normal, double height,
                       double width) {
  const double radius = (0.25 * width * width + height * height) / (2.0 * height);
  const Solid cap = ball(foot + (height - radius) * normal, radius), around = ball(foot, 0.5 * width);
  return [=](const Eigen::Vector3d& p) { return std::min(solid(p), std::max(cap(p), around(p))); };
}

}  // namespace scanrig::testing
