#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

// Shared by the readers of mesh files.
namespace scanrig {

/// Larger than any meaningful coordinate, small enough to be squared in single precision.
inline constexpr double kAbsurd = 1e15;

inline std::string_view next_word(std::string_view& text, std::string_view blanks = " \t\r") {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(blanks));
  text.remove_prefix(word.size());
  return word;
}

inline std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

template <class T>
std::optional<T> number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// The three coordinates that a line of text continues with; nothing for what is no number, or absurd.
inline std::optional<Eigen::Vector3f> next_vertex(std::string_view& line) {
  Eigen::Vector3d v;
  for (int k = 0; k < 3; ++k) v[k] = number<double>(next_word(line)).value_or(std::nan(""));
  if (v.hasNaN() || !(v.cwiseAbs().maxCoeff() < kAbsurd)) return std::nullopt;
  return v.cast<float>();
}

/// Adds the polygon's fan, corner by corner. False when there is no vertex `index`.
struct Fan {
  std::array<std::uint32_t, 2> held{};
  std::size_t corners = 0;

  bool add(double index, Mesh& mesh) {
    if (!(index >= 0.0 && index < static_cast<double>(mesh.vertices.size()))) return false;
    const auto corner = static_cast<std::uint32_t>(index);
    if (corners >= 2) mesh.faces.push_back({held[0], held[1], corner});
    held[corners == 0 ? 0 : 1] = corner;
    ++corners;
    return true;
  }
};

/// Final result of a reader.
inline Result<Mesh> checked(Mesh mesh, std::string_view name) {
  if (mesh.faces.empty()) return fail(ErrorCode::invalid_input, "{}: no faces; provide a surface, not points", name);
  if (mesh.vertices.size() > std::numeric_limits<std::int32_t>::max()) {
    return fail(ErrorCode::invalid_input, "{}: {} vertices are too many", name, mesh.vertices.size());
  }
  return mesh;
}

}  // namespace scanrig
