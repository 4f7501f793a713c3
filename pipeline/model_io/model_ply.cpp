#include <Eigen/Geometry>

#include "pipeline/mesh/solid_properties.h"
#include "pipeline/model_io/bytes.h"
#include "pipeline/model_io/model_files.h"
#include "pipeline/texture/shading.h"

namespace scanrig {

std::string encode_ply(const Mesh& mesh) {
  const std::size_t count = mesh.vertices.size();
  const bool coloured = mesh.colour.size() == count;
  const bool measured = mesh.views.size() == count && mesh.sigma.size() == count;
  const auto normals = mesh.normals.size() == count ? mesh.normals : vertex_normals(mesh);

  std::string file = "ply\nformat binary_little_endian 1.0\ncomment scanrig\ncomment units mm\ncomment up axis +Y\n";
  file += fmt::format("element vertex {}\n", count);
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) file += fmt::format("property float {}\n", name);
  if (coloured) file += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (measured) file += "property uchar views\nproperty float sigma\n";
  file += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.faces.size());

  file.reserve(file.size() + count * 32 + mesh.faces.size() * 13);
  for (std::size_t v = 0; v < count; ++v) {
    append_bytes(file, mesh.vertices[v]);
    append_bytes(file, normals[v]);
    if (coloured) append_bytes(file, mesh.colour[v]);
    if (measured) {
      append_bytes(file, mesh.views[v]);
      append_bytes(file, mesh.sigma[v]);
    }
  }
  for (const auto& face : mesh.faces) {
    append_bytes(file, std::uint8_t{3});
    append_bytes(file, face);
  }
  return file;
}

}  // namespace scanrig
