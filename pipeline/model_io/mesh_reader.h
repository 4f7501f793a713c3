#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Reads a mesh in the file's units. All fail with `not_found`, `io`, `invalid_input`, naming the file: not such a
/// file, cut short, no faces, a face with a missing vertex, a vertex that is not a number, two lists of vertices. Any
/// bytes are safe to read.

/// PLY: ascii or binary of either byte order; polygons become fans of triangles. Reads normals, colour (red green blue,
/// bytes or 0..1), `views` and `sigma` if present, and skips other properties.
Result<Mesh> read_ply(const std::filesystem::path& path);
/// Wavefront OBJ: vertices and faces only.
Result<Mesh> read_obj(const std::filesystem::path& path);
/// PLY, OBJ, STL or GLB, by the file name's extension.
Result<Mesh> read_mesh(const std::filesystem::path& path);

/// The same from bytes; `name` is for messages.
Result<Mesh> parse_ply(std::string_view bytes, std::string_view name);
Result<Mesh> parse_obj(std::string_view text, std::string_view name);
/// STL, binary or text: each triangle has three vertices of its own.
Result<Mesh> parse_stl(std::string_view bytes, std::string_view name);
/// glTF 2.0 binary, not compressed: all meshes of its scene, in mm (a file is in metres), vertices in the file's order;
/// normals and `_VIEWS` if all parts have them.
Result<Mesh> parse_glb(std::string_view bytes, std::string_view name);

}  // namespace scanrig
