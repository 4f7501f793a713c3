#include <iterator>

#include "pipeline/model_io/corner_vertices.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {

std::string encode_obj(const TexturedMesh& model, std::string_view material_file) {
  const CornerVertices corners(model);
  std::string file = fmt::format("# scanrig, units mm, up axis +Y\nmtllib {}\nusemtl scanned\n", material_file);
  const auto out = std::back_inserter(file);
  for (const auto& v : model.mesh.vertices) fmt::format_to(out, "v {:.7g} {:.7g} {:.7g}\n", v.x(), v.y(), v.z());
  // Texture coordinates of OBJ start at the bottom.
  for (const auto& uv : corners.uv) fmt::format_to(out, "vt {:.7f} {:.7f}\n", uv.x(), 1.0F - uv.y());
  for (std::size_t f = 0; f < corners.faces.size(); ++f) {
    const auto& [a, b, c] = model.mesh.faces[f];
    const auto& [ta, tb, tc] = corners.faces[f];
    fmt::format_to(out, "f {}/{} {}/{} {}/{}\n", a + 1, ta + 1, b + 1, tb + 1, c + 1, tc + 1);
  }
  return file;
}

std::string encode_mtl(std::string_view image_file) {
  return fmt::format("newmtl scanned\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {}\n", image_file);
}

}  // namespace scanrig
