#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "pipeline/model_io/glb_document.h"
#include "pipeline/model_io/mesh_limits.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {
namespace {

using nlohmann::json;

constexpr std::uint32_t kGlbMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kGlbJson = 0x4E4F534A, kGlbBinary = 0x004E4942;
constexpr int kTriangles = 4;
constexpr int kMaxDepth = 32;  // of the tree of nodes
constexpr std::size_t kMaxNodes = 100'000;
constexpr std::size_t kMaxVertices = 20'000'000;  // nodes may repeat a mesh
const std::set<std::string> kKnownExtensions{"KHR_mesh_quantization", "KHR_materials_unlit"};

/// What is wrong with the file, without its name.
struct BadGlb {
  std::string what;
};

std::uint32_t u32_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  if (at + 4 > bytes.size()) throw BadGlb{"is cut short"};
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

std::size_t bytes_of(int component) {
  switch (component) {
    case kGltfByte:
    case kGltfUbyte: return 1;
    case kGltfShort:
    case kGltfUshort: return 2;
    case kGltfUint:
    case kGltfFloat: return 4;
    default: throw BadGlb{"has a type of numbers that glTF does not know"};
  }
}

template <class T>
double number_at(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double component_at(const char* at, int component) {
  switch (component) {
    case kGltfByte: return number_at<std::int8_t>(at);
    case kGltfUbyte: return number_at<std::uint8_t>(at);
    case kGltfShort: return number_at<std::int16_t>(at);
    case kGltfUshort: return number_at<std::uint16_t>(at);
    case kGltfUint: return number_at<std::uint32_t>(at);
    default: return number_at<float>(at);
  }
}

/// A list of numbers within the file's binary part, checked against its end.
struct GlbNumbers {
  const char* first = nullptr;
  std::size_t count = 0, stride = 0;
  int component = 0;
  [[nodiscard]] double at(std::size_t i, std::size_t k) const {
    return component_at(first + i * stride + k * bytes_of(component), component);
  }
};

class GlbFile {
 public:
  explicit GlbFile(std::string_view bytes) {
    if (bytes.size() < 12 || u32_at(bytes, 0) != kGlbMagic) throw BadGlb{"is not a GLB file"};
    if (u32_at(bytes, 4) != 2) throw BadGlb{"is not of glTF's version 2"};
    for (std::size_t at = 12; at + 8 <= bytes.size();) {
      const std::size_t size = u32_at(bytes, at);
      if (size > bytes.size() - at - 8) throw BadGlb{"is cut short"};
      const auto chunk = bytes.substr(at + 8, size);
      if (u32_at(bytes, at + 4) == kGlbJson && gltf_.is_null()) gltf_ = json::parse(chunk);
      if (u32_at(bytes, at + 4) == kGlbBinary && binary_.empty()) binary_ = chunk;
      at += 8 + size;
    }
    if (!gltf_.is_object()) throw BadGlb{"has no description"};
    for (const auto& name : gltf_.value("extensionsRequired", json::array())) {
      if (!kKnownExtensions.contains(name.get<std::string>())) {
        throw BadGlb{"needs " + name.get<std::string>() + ", which is not read: write it without compression"};
      }
    }
  }

  Mesh whole() {
    const auto& nodes = gltf_.value("nodes", json::array());
    const auto scene = gltf_.value("scene", 0U);
    const auto scenes = gltf_.value("scenes", json::array());
    if (scene < scenes.size()) {
      for (const auto& node : scenes[scene].value("nodes", json::array()))
        add_node(nodes, node, Eigen::Affine3d::Identity(), 0);
    } else {
      for (std::size_t i = 0; i < nodes.size(); ++i) add_node(nodes, i, Eigen::Affine3d::Identity(), 0);
    }
    // An attribute that a part of the file lacks is none.
    if (mesh_.normals.size() != mesh_.vertices.size()) mesh_.normals.clear();
    if (mesh_.views.size() != mesh_.vertices.size()) mesh_.views.clear();
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] GlbNumbers numbers(std::size_t accessor_number, std::size_t per_value) const {
    const auto& accessor = gltf_.at("accessors").at(accessor_number);
    if (accessor.contains("sparse")) throw BadGlb{"has sparse numbers, which are not read"};
    const auto& view = gltf_.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
    if (view.value("buffer", 0U) != 0) throw BadGlb{"has numbers in another file"};
    GlbNumbers found;
    found.component = accessor.at("componentType").get<int>();
    found.count = accessor.at("count").get<std::size_t>();
    const std::size_t value_bytes = per_value * bytes_of(found.component);
    found.stride = view.value("byteStride", value_bytes);
    const auto view_at = view.value("byteOffset", std::size_t{0}), view_size = view.at("byteLength").get<std::size_t>();
    const auto at = accessor.value("byteOffset", std::size_t{0});
    const bool is_inside = view_at <= binary_.size() && view_size <= binary_.size() - view_at && at <= view_size &&
                           found.stride >= 1 && found.stride < 4096 && found.count <= binary_.size() &&
                           (found.count == 0 || (found.count - 1) * found.stride + value_bytes <= view_size - at);
    if (!is_inside) throw BadGlb{"names numbers behind its end"};
    found.first = binary_.data() + view_at + at;
    return found;
  }

  void add_node(const json& nodes, std::size_t number, const Eigen::Affine3d& parent, int depth) {
    if (depth > kMaxDepth || ++added_ > kMaxNodes) throw BadGlb{"has nodes without end"};
    const auto& node = nodes.at(number);
    const Eigen::Affine3d here = parent * placement(node);
    if (node.contains("mesh")) {
      for (const auto& part : gltf_.at("meshes").at(node["mesh"].get<std::size_t>()).at("primitives"))
        add_part(part, here);
    }
    for (const auto& child : node.value("children", json::array())) add_node(nodes, child, here, depth + 1);
  }

  static Eigen::Affine3d placement(const json& node) {
    Eigen::Affine3d here = Eigen::Affine3d::Identity();
    if (node.contains("matrix")) {
      const auto matrix = node["matrix"].get<std::vector<double>>();
      if (matrix.size() != 16) throw BadGlb{"has a matrix without 16 numbers"};
      for (std::size_t column = 0; column < 4; ++column) {
        for (std::size_t row = 0; row < 3; ++row) here.matrix()(row, column) = matrix[4 * column + row];
      }
      return here;
    }
    const auto list = [&](const char* name, const std::vector<double>& otherwise) {
      auto values = node.value(name, otherwise);
      if (values.size() != otherwise.size()) throw BadGlb{std::string("has a wrong ") + name};
      return values;
    };
    const auto t = list("translation", {0, 0, 0}), q = list("rotation", {0, 0, 0, 1}), s = list("scale", {1, 1, 1});
    here = Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized() *
           Eigen::Scaling(s[0], s[1], s[2]);
    return here;
  }

  void add_part(const json& part, const Eigen::Affine3d& here) {
    if (part.value("mode", kTriangles) != kTriangles) return;  // lines and points are no surface
    const auto& attributes = part.at("attributes");
    const auto positions = numbers(attributes.at("POSITION").get<std::size_t>(), 3);
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    if (mesh_.vertices.size() + positions.count > kMaxVertices) throw BadGlb{"is too large"};
    for (std::size_t i = 0; i < positions.count; ++i) {
      const Eigen::Vector3d p =
          here * Eigen::Vector3d(positions.at(i, 0), positions.at(i, 1), positions.at(i, 2)) / kMetresPerMm;
      if (!(p.cwiseAbs().maxCoeff() < kAbsurd)) throw BadGlb{"has a vertex that is not a number"};
      mesh_.vertices.push_back(p.cast<float>());
    }
    add_attributes(attributes, here, positions.count);
    const bool is_mirrored = here.linear().determinant() < 0.0;
    const auto add_face = [&](const auto& corner) {
      Mesh::Face face{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto index = corner(k);
        if (!(index < static_cast<double>(positions.count))) throw BadGlb{"has a face that names a missing vertex"};
        face[k] = first + static_cast<std::uint32_t>(index);
      }
      if (is_mirrored) std::swap(face[1], face[2]);
      if (mesh_.faces.size() == kMaxVertices) throw BadGlb{"is too large"};
      mesh_.faces.push_back(face);
    };
    if (!part.contains("indices")) {
      for (std::size_t i = 0; i + 2 < positions.count; i += 3) {
        add_face([&](std::size_t k) { return static_cast<double>(i + k); });
      }
      return;
    }
    const auto indices = numbers(part["indices"].get<std::size_t>(), 1);
    if (indices.component == kGltfFloat || indices.component == kGltfByte || indices.component == kGltfShort) {
      throw BadGlb{"has faces of numbers that are not whole"};
    }
    for (std::size_t i = 0; i + 2 < indices.count; i += 3) {
      add_face([&](std::size_t k) { return indices.at(i + k, 0); });
    }
  }

  void add_attributes(const json& attributes, const Eigen::Affine3d& here, std::size_t count) {
    if (attributes.contains("NORMAL")) {
      const auto normals = numbers(attributes["NORMAL"].get<std::size_t>(), 3);
      const Eigen::Matrix3d turn = here.linear().inverse().transpose();
      for (std::size_t i = 0; i < std::min(count, normals.count); ++i) {
        const Eigen::Vector3d n = turn * Eigen::Vector3d(normals.at(i, 0), normals.at(i, 1), normals.at(i, 2));
        mesh_.normals.push_back((n.allFinite() ? n.normalized() : Eigen::Vector3d::Zero().eval()).cast<float>());
      }
    }
    if (attributes.contains("_VIEWS")) {
      const auto views = numbers(attributes["_VIEWS"].get<std::size_t>(), 1);
      for (std::size_t i = 0; i < std::min(count, views.count); ++i) {
        mesh_.views.push_back(static_cast<std::uint8_t>(std::clamp(views.at(i, 0), 0.0, 255.0)));
      }
    }
  }

  json gltf_;
  std::string_view binary_;
  Mesh mesh_;
  std::size_t added_ = 0;
};

}  // namespace

Result<Mesh> parse_glb(std::string_view bytes, std::string_view name) {
  try {
    return checked(GlbFile(bytes).whole(), name);
  } catch (const BadGlb& bad) {
    return fail(ErrorCode::invalid_input, "{}: {}", name, bad.what);
  } catch (const json::exception&) {
    return fail(ErrorCode::invalid_input, "{}: its description is damaged", name);
  }
}

}  // namespace scanrig
