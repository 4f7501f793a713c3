#include <fmt/format.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <span>
#include <stdexcept>

#include "core/files.h"
#include "core/image_codec.h"
#include "sim/scene/mesh_file.h"
#include "sim/scene/texture_image.h"

namespace scanrig::sim {
namespace {

using Eigen::Affine3d;

/// Keeps the encoded bytes; only the image that is used is decoded.
bool keep_bytes(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes, int size,
                void*) {
  image->image.assign(bytes, bytes + size);
  return true;
}

/// Reads element `i` of an accessor as `count` numbers, whatever their type.
std::array<double, 4> element(const tinygltf::Model& model, int accessor_index, std::size_t i, int count) {
  const auto& accessor = model.accessors.at(accessor_index);
  const auto& view = model.bufferViews.at(accessor.bufferView);
  const auto& bytes = model.buffers.at(view.buffer).data;
  const auto stride = static_cast<std::size_t>(accessor.ByteStride(view));
  const auto size =
      static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<unsigned>(accessor.componentType)));
  const std::size_t start = view.byteOffset + accessor.byteOffset + i * stride;
  std::array<double, 4> values{};
  for (int c = 0; c < count; ++c) {
    const unsigned char* at = &bytes.at(start + c * size + size - 1) - (size - 1);
    const auto take = [&](auto value) {
      std::memcpy(&value, at, sizeof value);
      return static_cast<double>(value);
    };
    switch (accessor.componentType) {
      case TINYGLTF_COMPONENT_TYPE_FLOAT: values[c] = take(0.0F); break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: values[c] = take(std::uint32_t{}); break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: values[c] = take(std::uint16_t{}); break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: values[c] = take(std::uint8_t{}); break;
      default: values[c] = std::nan(""); break;
    }
    if (accessor.normalized) values[c] /= size == 1 ? 255.0 : 65535.0;
  }
  return values;
}

Affine3d node_transform(const tinygltf::Node& node) {
  Affine3d t = Affine3d::Identity();
  if (node.matrix.size() == 16) {
    t.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
    return t;
  }
  if (node.translation.size() == 3) t.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
  if (node.rotation.size() == 4) t.rotate(Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(node.rotation.data())));
  if (node.scale.size() == 3) t.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
  return t;
}

void add_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive, const Affine3d& placed,
                   MeshFile& out) {
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) return;
  const int positions = primitive.attributes.at("POSITION");
  const auto uv = primitive.attributes.find("TEXCOORD_0");
  const bool textured = uv != primitive.attributes.end();
  const int first = static_cast<int>(out.mesh.vertices.size());
  const std::size_t vertices = model.accessors.at(positions).count;
  for (std::size_t i = 0; i < vertices; ++i) {
    const auto p = element(model, positions, i, 3);
    out.mesh.vertices.push_back(placed * Eigen::Vector3d(p[0], p[1], p[2]));
  }
  const std::size_t count = primitive.indices < 0 ? vertices : model.accessors.at(primitive.indices).count;
  for (std::size_t i = 0; i + 2 < count; i += 3) {
    Eigen::Vector3i t;
    std::array<Eigen::Vector2f, 3> corners{};
    for (int c = 0; c < 3; ++c) {
      const std::size_t v =
          primitive.indices < 0 ? i + c : static_cast<std::size_t>(element(model, primitive.indices, i + c, 1)[0]);
      t[c] = first + static_cast<int>(v);
      if (!textured) continue;
      const auto at = element(model, uv->second, v, 2);  // glTF counts v from the top of the image
      corners[c] = Eigen::Vector2d(at[0], 1.0 - at[1]).cast<float>();
    }
    out.mesh.triangles.push_back(t);
    out.corners.push_back(corners);
  }
  if (!textured || primitive.material < 0 || !out.image.empty()) return;
  const int texture = model.materials.at(primitive.material).pbrMetallicRoughness.baseColorTexture.index;
  if (texture < 0) return;
  const auto& encoded = model.images.at(model.textures.at(texture).source).image;
  const auto image = decode_texture(as_text(std::as_bytes(std::span(encoded))));
  if (!image) throw std::runtime_error(fmt::format("texture: {}", image.error().message));
  out.image = *image;
}

void add_node(const tinygltf::Model& model, int index, const Affine3d& parent, MeshFile& out, int depth = 0) {
  const auto& node = model.nodes.at(index);
  const Affine3d placed = parent * node_transform(node);
  if (node.mesh >= 0) {
    for (const auto& primitive : model.meshes.at(node.mesh).primitives) add_primitive(model, primitive, placed, out);
  }
  constexpr int kMaxDepth = 64;  // ends the reading of a file that contains itself
  for (const int child : node.children) {
    if (depth < kMaxDepth) add_node(model, child, placed, out, depth + 1);
  }
}

}  // namespace

Result<MeshFile> read_glb(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return pass_on(bytes);
  MeshFile out;
  try {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader(keep_bytes, nullptr);
    tinygltf::Model model;
    std::string error, warning;
    const auto* data = reinterpret_cast<const unsigned char*>(bytes->data());
    if (!reader.LoadBinaryFromMemory(&model, &error, &warning, data, static_cast<unsigned>(bytes->size()))) {
      return fail(ErrorCode::invalid_input, "object {}: not a GLB file that can be read: {}", file.string(), error);
    }
    std::vector<int> roots;
    if (!model.scenes.empty()) roots = model.scenes.at(std::max(model.defaultScene, 0)).nodes;
    for (const int root : roots) add_node(model, root, Affine3d::Identity(), out);
  } catch (const std::exception& e) {
    return fail(ErrorCode::invalid_input, "object {}: a damaged GLB file ({})", file.string(), e.what());
  }
  if (out.image.empty()) out.corners.clear();
  return out;
}

}  // namespace scanrig::sim
