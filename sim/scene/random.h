#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace scanrig::sim {

/// Mixes a counter into 64 random bits (SplitMix64's finaliser). Random numbers here are functions of their purpose,
/// never of a running state: the same pixel gets the same noise from any thread.
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

template <class... Keys>
constexpr std::uint64_t mix(std::uint64_t first, Keys... rest) {
  std::uint64_t state = mix(first);
  ((state = mix(state ^ static_cast<std::uint64_t>(rest))), ...);
  return state;
}

/// [0, 1)
constexpr double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1.0p-53; }

/// Standard normal.
inline double normal(std::uint64_t bits) {
  const double u = 1.0 - uniform(bits);
  const double v = uniform(mix(bits));
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

}  // namespace scanrig::sim
