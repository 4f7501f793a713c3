#include <nlohmann/json.hpp>

#include "core/image_codec.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/model_io/bytes.h"
#include "pipeline/model_io/corner_vertices.h"
#include "pipeline/model_io/model_files.h"
#include "pipeline/texture/shading.h"

namespace scanrig {
namespace {

using nlohmann::json;

// Numbers of the glTF 2.0 specification.
constexpr std::uint32_t kMagic = 0x46546C67;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinChunk = 0x004E4942;
constexpr int kFloat = 5126;
constexpr int kUint = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kLinear = 9729;
constexpr int kLinearMipmapLinear = 9987;
constexpr int kClampToEdge = 33071;

constexpr float kMetresPerMm = 0.001F;
constexpr int kJpegQuality = 95;

/// The binary chunk with its views and accessors.
struct Buffer {
  std::string bytes;
  json views = json::array();
  json accessors = json::array();

  int add_view(std::size_t begin, std::optional<int> target) {
    json view = {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes.size() - begin}};
    if (target) view["target"] = *target;
    views.push_back(view);
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    return static_cast<int>(views.size() - 1);
  }
  template <class T>
  int add(const std::vector<T>& values, int component, const char* type, int per_value, int target) {
    const std::size_t begin = bytes.size();
    for (const T& value : values) append_bytes(bytes, value);
    accessors.push_back({{"bufferView", add_view(begin, target)},
                         {"componentType", component},
                         {"count", values.size() * static_cast<std::size_t>(per_value)},
                         {"type", type}});
    return static_cast<int>(accessors.size() - 1);
  }
};

json add_geometry(const TexturedMesh& model, bool textured, Buffer& buffer) {
  const CornerVertices corners(model);
  const auto normals =
      model.mesh.normals.size() == model.mesh.vertices.size() ? model.mesh.normals : vertex_normals(model.mesh);
  std::vector<Eigen::Vector3f> positions, directions;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = -low;
  for (const auto v : corners.vertex) {
    positions.emplace_back(kMetresPerMm * model.mesh.vertices[v]);
    directions.push_back(normals[v]);
    low = low.cwiseMin(positions.back());
    high = high.cwiseMax(positions.back());
  }
  json attributes;
  const int position = buffer.add(positions, kFloat, "VEC3", 1, kArrayBuffer);
  buffer.accessors[position]["min"] = {low.x(), low.y(), low.z()};
  buffer.accessors[position]["max"] = {high.x(), high.y(), high.z()};
  attributes["POSITION"] = position;
  attributes["NORMAL"] = buffer.add(directions, kFloat, "VEC3", 1, kArrayBuffer);
  if (textured) attributes["TEXCOORD_0"] = buffer.add(corners.uv, kFloat, "VEC2", 1, kArrayBuffer);
  const int indices = buffer.add(corners.faces, kUint, "SCALAR", 3, kElementArrayBuffer);
  return {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
}

Result<void> add_texture(const cv::Mat3b& atlas, Buffer& buffer, json& gltf) {
  const auto jpeg = encode_jpeg(atlas, kJpegQuality);
  if (!jpeg) return pass_on(jpeg, "glTF");
  const std::size_t begin = buffer.bytes.size();
  buffer.bytes.append(as_text(*jpeg));
  gltf["images"] = {{{"bufferView", buffer.add_view(begin, {})}, {"mimeType", "image/jpeg"}}};
  gltf["samplers"] = {
      {{"magFilter", kLinear}, {"minFilter", kLinearMipmapLinear}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}}};
  gltf["textures"] = {{{"source", 0}, {"sampler", 0}}};
  gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  return {};
}

std::string container(std::string text, const std::string& binary) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string file;
  append_bytes(file, kMagic);
  append_bytes(file, std::uint32_t{2});
  append_bytes(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  append_bytes(file, static_cast<std::uint32_t>(text.size()));
  append_bytes(file, kJsonChunk);
  file += text;
  append_bytes(file, static_cast<std::uint32_t>(binary.size()));
  append_bytes(file, kBinChunk);
  file += binary;
  return file;
}

}  // namespace

Result<std::string> encode_glb(const TexturedMesh& model) {
  if (model.mesh.faces.empty()) return fail(ErrorCode::degenerate, "glTF: the model has no faces");
  const bool textured = !model.atlas.empty() && model.corner_uv.size() == model.mesh.faces.size();
  Buffer buffer;
  json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "scanrig"}};
  gltf["scene"] = 0;
  gltf["scenes"] = {{{"nodes", {0}}}};
  gltf["nodes"] = {{{"mesh", 0}, {"name", "model"}}};
  gltf["materials"] = {
      {{"name", "scanned"}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}}};
  gltf["meshes"] = {{{"primitives", {add_geometry(model, textured, buffer)}}}};
  if (textured) {
    if (auto added = add_texture(model.atlas, buffer, gltf); !added) return pass_on(added);
  }
  gltf["buffers"] = {{{"byteLength", buffer.bytes.size()}}};
  gltf["bufferViews"] = buffer.views;
  gltf["accessors"] = buffer.accessors;
  return container(gltf.dump(), buffer.bytes);
}

}  // namespace scanrig
