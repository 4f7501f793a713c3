// Colours defined in space rather than on the surface: no seams, any resolution.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/scene/random.h"
#include "sim/scene/solid_patches.h"
#include "sim/scene/surface_colour.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;

std::uint64_t cell_hash(const Vector3i& c, unsigned salt) {
  const auto key = [](int i) { return static_cast<std::uint64_t>(std::int64_t{i} + 4096); };
  return mix(key(c.x()) << 40 | key(c.y()) << 20 | key(c.z()) | static_cast<std::uint64_t>(salt) << 58);
}

/// Value noise in [-1, 1] of one wavelength (mm), averaged away as the footprint grows past it.
double grain(const Vector3d& p, double wavelength, double footprint, unsigned salt) {
  const double kept = std::exp(-2.0 * std::pow(footprint / wavelength, 2.0));
  if (kept < 0.01) return 0.0;
  const Vector3d q = p / wavelength;
  const Vector3i c = q.array().floor().cast<int>();
  const Vector3d f = q - c.cast<double>();
  const Vector3d s = f.array() * f.array() * (3.0 - 2.0 * f.array());
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3i d(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const double weight = (d.x() ? s.x() : 1.0 - s.x()) * (d.y() ? s.y() : 1.0 - s.y()) * (d.z() ? s.z() : 1.0 - s.z());
    sum += weight * (2.0 * uniform(cell_hash(c + d, salt)) - 1.0);
  }
  return kept * sum;
}

/// 0 below -half the width, 1 above: an edge averaged over the footprint.
double edge(double distance, double width) {
  const double t = std::clamp(distance / width + 0.5, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

class Painted final : public SurfaceColour {
 public:
  Vector3f albedo(const SurfacePoint& at) const override {
    const double width = std::max(at.footprint_mm, 0.25);
    const Vector3d warp(grain(at.position, 9.0, 0.0, 1), grain(at.position, 9.0, 0.0, 2),
                        grain(at.position, 9.0, 0.0, 3));
    const Vector3d p = at.position + 2.0 * warp;
    const SolidPatches patch = solid_patches(p, 17.0, 4);
    const double share = edge(patch.margin, 2.0 * width);  // 0.5 on the border
    const Vector3f colour = static_cast<float>(share) * paint(patch.first, p, width) +
                            static_cast<float>(1.0 - share) * paint(patch.second, p, width);
    const double fine = 0.19 * grain(at.position, 0.7, at.footprint_mm, 5) +
                        0.15 * grain(at.position, 1.6, at.footprint_mm, 6) +
                        0.10 * grain(at.position, 4.1, at.footprint_mm, 7);
    return measurable(static_cast<float>(1.0 + fine) * colour);
  }

 private:
  static Vector3f paint(std::uint64_t patch, const Vector3d& p, double width) {
    static const std::array<Vector3f, 8> kPalette = {Vector3f(0.72F, 0.16F, 0.08F), Vector3f(0.78F, 0.55F, 0.10F),
                                                     Vector3f(0.20F, 0.48F, 0.14F), Vector3f(0.80F, 0.74F, 0.60F),
                                                     Vector3f(0.52F, 0.28F, 0.14F), Vector3f(0.70F, 0.34F, 0.36F),
                                                     Vector3f(0.40F, 0.50F, 0.38F), Vector3f(0.76F, 0.40F, 0.12F)};
    const Vector3f& ground = kPalette[patch % kPalette.size()];
    const Vector3f& figure = kPalette[(patch % kPalette.size() + 1 + (patch >> 8) % 7) % kPalette.size()];
    double share = 0.0;
    if ((patch >> 16) % 2 == 0) {  // stripes, each patch in its own direction
      const double tilt = 2.0 * std::numbers::pi * uniform(mix(patch + 2));
      const Vector3d across(std::cos(tilt), 0.6, std::sin(tilt));
      constexpr double kPeriod = 3.6;
      const double phase = p.dot(across.normalized()) / kPeriod;
      share = edge(kPeriod * (std::abs(phase - std::floor(phase) - 0.5) - 0.25), width);
    } else {  // spots
      const SolidPatches spot = solid_patches(p, 4.2, 8);
      share = edge(spot.margin - 0.45, width);
    }
    return static_cast<float>(1.0 - 0.75 * share) * ground + static_cast<float>(0.75 * share) * figure;
  }
};

class Stone final : public SurfaceColour {
 public:
  Vector3f albedo(const SurfacePoint& at) const override {
    double value = 0.46, warmth = 0.0;
    constexpr std::array<double, 6> kWavelength = {0.6, 1.1, 2.1, 4.3, 8.7, 16.0};
    constexpr std::array<double, 6> kStrength = {0.16, 0.15, 0.12, 0.09, 0.07, 0.07};
    for (unsigned i = 0; i < kWavelength.size(); ++i) {
      const double g = grain(at.position, kWavelength[i], at.footprint_mm, 16 + i);
      value += kStrength[i] * g;
      if (i > 2) warmth += 0.05 * g;
    }
    const Vector3d tint(1.06 + warmth, 1.0, 0.86 - warmth);
    return measurable((value * tint).cast<float>());
  }
};

}  // namespace

SolidPatches solid_patches(const Vector3d& p, double size, unsigned salt) {
  const Vector3i c = (p / size).array().floor().cast<int>();
  double nearest = 1e300, next = 1e300;
  SolidPatches found;
  for (int i = 0; i < 27; ++i) {
    const Vector3i cell = c + Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    const std::uint64_t h = cell_hash(cell, salt);
    const Vector3d jitter(uniform(h), uniform(mix(h)), uniform(mix(h + 1)));
    const double d = (p - size * (cell.cast<double>() + jitter)).norm();
    if (d < nearest) {
      next = nearest, found.second = found.first;
      nearest = d, found.first = h;
    } else if (d < next) {
      next = d, found.second = h;
    }
  }
  found.margin = 0.5 * (next - nearest);
  return found;
}

std::unique_ptr<SurfaceColour> painted_colour() { return std::make_unique<Painted>(); }
std::unique_ptr<SurfaceColour> stone_colour() { return std::make_unique<Stone>(); }

}  // namespace scanrig::sim
