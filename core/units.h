#pragma once

#include <compare>
#include <numbers>

namespace scanrig {

/// An angle as people and drives write it. Inside the mathematics angles are plain doubles in radians.
struct Degrees {
  double value = 0.0;
  auto operator<=>(const Degrees&) const = default;
  friend Degrees operator+(Degrees a, Degrees b) { return {a.value + b.value}; }
  friend Degrees operator-(Degrees a, Degrees b) { return {a.value - b.value}; }
};

struct DegreesPerSecond {
  double value = 0.0;
  auto operator<=>(const DegreesPerSecond&) const = default;
};

struct DegreesPerSecond2 {
  double value = 0.0;
  auto operator<=>(const DegreesPerSecond2&) const = default;
};

inline constexpr double kMicrometresPerMm = 1e3;

constexpr double to_radians(double degrees) { return degrees * std::numbers::pi / 180.0; }
constexpr double to_radians(Degrees angle) { return to_radians(angle.value); }
constexpr double to_degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

}  // namespace scanrig
