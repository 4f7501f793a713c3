#include "pipeline/mesh/decimate.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <vector>

#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/topology.h"

namespace scanrig {

Result<Mesh> decimate(const Mesh& mesh, const DecimateOptions& options) {
  if (!(options.max_error_mm > 0.0)) {
    return fail(ErrorCode::invalid_input, "decimate: the error bound must be positive, got {} mm",
                options.max_error_mm);
  }
  if (!topology(mesh).watertight()) {
    return fail(ErrorCode::not_closed, "decimate: the mesh is not a closed manifold");
  }
  std::vector<unsigned> indices;
  indices.reserve(3 * mesh.faces.size());
  for (const auto& face : mesh.faces) indices.insert(indices.end(), face.begin(), face.end());

  const float* positions = mesh.vertices.front().data();
  const float scale = meshopt_simplifyScale(positions, mesh.vertices.size(), sizeof(Eigen::Vector3f));
  std::vector<unsigned> fewer(indices.size());
  const std::size_t count = meshopt_simplify(fewer.data(), indices.data(), indices.size(), positions,
                                             mesh.vertices.size(), sizeof(Eigen::Vector3f), 3 * options.target_faces,
                                             static_cast<float>(options.max_error_mm) / scale, /*options=*/0,
                                             /*result_error=*/nullptr);

  Mesh simplified = mesh;
  simplified.faces.clear();
  for (std::size_t i = 0; i + 2 < count; i += 3) simplified.faces.push_back({fewer[i], fewer[i + 1], fewer[i + 2]});
  Mesh result = kept_faces(simplified, std::vector<bool>(simplified.faces.size(), true));
  if (!topology(result).watertight()) return mesh;  // a collapse that pinched the surface is useless
  result.normals = vertex_normals(result);
  return result;
}

}  // namespace scanrig
