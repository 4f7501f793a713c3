#include "pipeline/mesh/solid_properties.h"
#include "pipeline/model_io/corner_vertices.h"
#include "pipeline/model_io/glb_document.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {
namespace {

using nlohmann::json;

constexpr int kJpegQuality = 95;

json add_geometry(const TexturedMesh& model, bool textured, GlbDocument& document) {
  const CornerVertices corners(model);
  const auto normals =
      model.mesh.normals.size() == model.mesh.vertices.size() ? model.mesh.normals : vertex_normals(model.mesh);
  std::vector<Eigen::Vector3f> positions, directions;
  positions.reserve(corners.vertex.size());
  directions.reserve(corners.vertex.size());
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = -low;
  for (const auto v : corners.vertex) {
    positions.emplace_back(static_cast<float>(kMetresPerMm) * model.mesh.vertices[v]);
    directions.push_back(normals[v]);
    low = low.cwiseMin(positions.back());
    high = high.cwiseMax(positions.back());
  }
  json attributes;
  const int position = document.add(positions, kGltfFloat, "VEC3", 1, kGltfArrayBuffer);
  document.accessor(position)["min"] = {low.x(), low.y(), low.z()};
  document.accessor(position)["max"] = {high.x(), high.y(), high.z()};
  attributes["POSITION"] = position;
  attributes["NORMAL"] = document.add(directions, kGltfFloat, "VEC3", 1, kGltfArrayBuffer);
  if (textured) attributes["TEXCOORD_0"] = document.add(corners.uv, kGltfFloat, "VEC2", 1, kGltfArrayBuffer);
  const int indices = document.add(corners.faces, kGltfUint, "SCALAR", 3, kGltfElementArrayBuffer);
  return {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
}

}  // namespace

Result<std::string> encode_glb(const TexturedMesh& model) {
  if (model.mesh.faces.empty()) return fail(ErrorCode::degenerate, "glTF: the model has no faces");
  const bool textured = !model.atlas.empty() && model.corner_uv.size() == model.mesh.faces.size();
  GlbDocument document;
  document.gltf["meshes"] = {{{"primitives", {add_geometry(model, textured, document)}}}};
  if (textured) {
    if (auto added = document.add_texture(model.atlas, kJpegQuality); !added) return pass_on(added);
  }
  return document.file();
}

}  // namespace scanrig
