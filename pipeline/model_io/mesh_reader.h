#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Reads a mesh; units are the file's. All fail with `not_found`, `io`, `invalid_input` (not such a file, cut short, no
/// faces, a face that names no vertex, a vertex that is not a number, two lists of vertices), naming the file. Any
/// bytes are safe to read.

/// PLY: ascii or binary of either byte order; polygons become fans of triangles. Takes normals, colour (red green blue,
/// bytes or 0..1), `views` and `sigma` where the file has them, and skips what it does not know.
Result<Mesh> read_ply(const std::filesystem::path& path);
/// Wavefront OBJ: vertices and faces only.
Result<Mesh> read_obj(const std::filesystem::path& path);
/// One of these by the name's ending.
Result<Mesh> read_mesh(const std::filesystem::path& path);

/// The same from bytes; `name` is for messages.
Result<Mesh> parse_ply(std::string_view bytes, std::string_view name);
Result<Mesh> parse_obj(std::string_view text, std::string_view name);

}  // namespace scanrig
