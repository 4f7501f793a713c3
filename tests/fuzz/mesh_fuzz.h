#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {

/// Any bytes: a mesh whose faces refer to existing vertices and whose attributes are none or one per vertex, or an
/// error that names the file.
template <class Parse>
int mesh_fuzz(Parse parse, const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kName = "input.mesh";
  const auto mesh = parse({reinterpret_cast<const char*>(data), size}, kName);
  if (!mesh) {
    if (mesh.error().message.find(kName) == std::string::npos) std::abort();
    return 0;
  }
  for (const auto& face : mesh->faces) {
    for (const auto vertex : face) {
      if (vertex >= mesh->vertices.size()) std::abort();
    }
  }
  for (const auto count : {mesh->normals.size(), mesh->views.size(), mesh->sigma.size(), mesh->colour.size()}) {
    if (count != 0 && count != mesh->vertices.size()) std::abort();
  }
  return 0;
}

}  // namespace scanrig
