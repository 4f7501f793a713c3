#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "pipeline/scan/model/mesh_reader.h"

// Any bytes: a mesh whose faces name vertices that are there, or an error that names the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto mesh = scanrig::parse_obj({reinterpret_cast<const char*>(data), size}, "input.obj");
  if (!mesh) {
    if (mesh.error().message.find("input.obj") == std::string::npos) std::abort();
    return 0;
  }
  for (const auto& face : mesh->faces) {
    for (const auto vertex : face) {
      if (vertex >= mesh->vertices.size()) std::abort();
    }
  }
  if (!mesh->colour.empty() && mesh->colour.size() != mesh->vertices.size()) std::abort();
  return 0;
}
