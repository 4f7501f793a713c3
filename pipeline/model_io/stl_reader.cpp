#include <cmath>
#include <cstring>

#include "pipeline/model_io/mesh_limits.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {
namespace {

constexpr std::size_t kStlHead = 80;
constexpr std::size_t kStlTriangle = 50;  // normal, three corners, two bytes of attributes

Result<Mesh> binary_stl(std::string_view bytes, std::string_view name, std::uint32_t triangles) {
  Mesh mesh;
  mesh.vertices.reserve(std::size_t{3} * triangles);
  mesh.faces.reserve(triangles);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    std::array<float, 9> corners{};
    std::memcpy(corners.data(), bytes.data() + kStlHead + 4 + t * kStlTriangle + 12, sizeof corners);
    for (const float value : corners) {
      if (!(std::abs(value) < kAbsurd)) {
        return fail(ErrorCode::invalid_input, "{}, triangle {}: a vertex that is not a number", name, t + 1);
      }
    }
    for (std::size_t k = 0; k < 9; k += 3) mesh.vertices.emplace_back(corners[k], corners[k + 1], corners[k + 2]);
    mesh.faces.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return checked(std::move(mesh), name);
}

Result<Mesh> text_stl(std::string_view text, std::string_view name) {
  Mesh mesh;
  std::size_t corners = 0;  // of the triangle that is being read
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view rest = next_line(text);
    const auto keyword = next_word(rest);
    if (keyword == "vertex") {
      const auto vertex = next_vertex(rest);
      if (!vertex) {
        return fail(ErrorCode::invalid_input, "{}, line {}: a vertex that is not a number", name, line_number);
      }
      mesh.vertices.push_back(*vertex);
      ++corners;
    } else if (keyword == "endloop" || keyword == "outer") {
      if (corners != (keyword == "endloop" ? 3 : 0)) {
        return fail(ErrorCode::invalid_input, "{}, line {}: a triangle has {} corners", name, line_number, corners);
      }
      const auto end = static_cast<std::uint32_t>(mesh.vertices.size());
      if (corners == 3) mesh.faces.push_back({end - 3, end - 2, end - 1});
      corners = 0;
    }
  }
  if (corners != 0) return fail(ErrorCode::invalid_input, "{}: ends within a triangle", name);
  return checked(std::move(mesh), name);
}

}  // namespace

Result<Mesh> parse_stl(std::string_view bytes, std::string_view name) {
  // Some programs begin a binary file with "solid" too: its size tells.
  std::uint32_t triangles = 0;
  if (bytes.size() >= kStlHead + 4) std::memcpy(&triangles, bytes.data() + kStlHead, 4);
  const std::size_t size = kStlHead + 4 + kStlTriangle * triangles;
  if (bytes.size() >= kStlHead + 4 && bytes.size() == size) return binary_stl(bytes, name, triangles);
  if (bytes.starts_with("solid")) return text_stl(bytes, name);
  if (bytes.size() < kStlHead + 4) return fail(ErrorCode::invalid_input, "{}: not an STL file", name);
  return fail(ErrorCode::invalid_input, "{}: {} triangles need {} bytes, it has {}", name, triangles, size,
              bytes.size());
}

}  // namespace scanrig
