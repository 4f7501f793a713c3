#include <Eigen/Geometry>

#include "pipeline/model_io/bytes.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {

std::string encode_stl(const Mesh& mesh) {
  std::string file = "scanrig model, binary STL, units mm, up axis +Y";  // must not begin with "solid": that means text
  file.resize(80, ' ');
  append_bytes(file, static_cast<std::uint32_t>(mesh.faces.size()));
  file.reserve(file.size() + mesh.faces.size() * 50);
  for (const auto& [a, b, c] : mesh.faces) {
    const Eigen::Vector3f normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).normalized();
    append_bytes(file, normal);
    for (const auto v : {a, b, c}) append_bytes(file, mesh.vertices[v]);
    append_bytes(file, std::uint16_t{0});
  }
  return file;
}

}  // namespace scanrig
