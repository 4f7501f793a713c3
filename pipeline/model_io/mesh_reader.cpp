#include "pipeline/model_io/mesh_reader.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/files.h"
#include "pipeline/model_io/mesh_limits.h"

namespace scanrig {

Result<Mesh> parse_obj(std::string_view text, std::string_view name) {
  Mesh mesh;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view rest = next_line(text);
    const auto keyword = next_word(rest);
    if (keyword == "v") {
      const auto vertex = next_vertex(rest);
      if (!vertex) {
        return fail(ErrorCode::invalid_input, "{}, line {}: a vertex that is not a number", name, line_number);
      }
      mesh.vertices.push_back(*vertex);
    } else if (keyword == "f") {
      Fan fan;
      for (auto word = next_word(rest); !word.empty(); word = next_word(rest)) {
        const auto index = number<std::int64_t>(word.substr(0, word.find('/')));
        // 1-based; negative numbers count back from the last vertex.
        const double at = !index       ? -1.0
                          : *index < 0 ? static_cast<double>(*index) + static_cast<double>(mesh.vertices.size())
                                       : static_cast<double>(*index) - 1.0;
        if (!fan.add(at, mesh)) {
          return fail(ErrorCode::invalid_input, "{}, line {}: a face names a missing vertex", name, line_number);
        }
      }
      if (fan.corners < 3) {
        return fail(ErrorCode::invalid_input, "{}, line {}: a face has {} corners", name, line_number, fan.corners);
      }
    }
  }
  return checked(std::move(mesh), name);
}

Result<Mesh> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return pass_on(bytes);
  return parse_ply(*bytes, path.string());
}

Result<Mesh> read_obj(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text);
  return parse_obj(*text, path.string());
}

Result<Mesh> read_mesh(const std::filesystem::path& path) {
  std::string kind = path.extension().string();
  std::ranges::transform(kind, kind.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto parse = kind == ".ply"   ? &parse_ply
                     : kind == ".obj" ? &parse_obj
                     : kind == ".stl" ? &parse_stl
                     : kind == ".glb" ? &parse_glb
                                      : nullptr;
  if (parse == nullptr) return fail(ErrorCode::invalid_input, "{}: neither .stl, .ply, .obj nor .glb", path.string());
  const auto bytes = read_file(path);
  if (!bytes) return pass_on(bytes);
  return parse(*bytes, path.string());
}

}  // namespace scanrig
