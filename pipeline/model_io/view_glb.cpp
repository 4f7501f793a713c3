#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "pipeline/mesh/solid_properties.h"
#include "pipeline/model_io/corner_vertices.h"
#include "pipeline/model_io/glb_document.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {
namespace {

using nlohmann::json;

constexpr int kViewJpegQuality = 85;
constexpr float kMaxError = 0.01F;  // of the object's size; the number of faces ends it earlier
constexpr float kSteps = 65535.0F;  // of a position along the longest side of the box
constexpr std::uint16_t kSigmaUnknown = 65535;
constexpr float kSigmaPerMm = 1e5F;

/// One vertex as the file keeps it: KHR_mesh_quantization, each attribute on a multiple of 4 bytes.
struct ViewVertex {
  std::array<std::uint16_t, 4> position{};  // the last is padding
  std::array<std::int8_t, 4> normal{};
  std::array<std::uint16_t, 2> uv{};
  std::array<std::uint8_t, 4> colour{};  // linear, as glTF wants it
  std::array<std::uint8_t, 4> views{};
  std::array<std::uint16_t, 2> sigma{};
};

std::vector<Mesh::Face> fewer_faces(const CornerVertices& corners, const std::vector<Eigen::Vector3f>& positions,
                                    std::size_t max_faces) {
  if (corners.faces.size() <= max_faces) return corners.faces;
  std::vector<Mesh::Face> fewer(corners.faces.size());
  const std::size_t count = meshopt_simplify(
      fewer.front().data(), corners.faces.front().data(), 3 * corners.faces.size(), positions.front().data(),
      positions.size(), sizeof(Eigen::Vector3f), 3 * max_faces, kMaxError, /*options=*/0, /*result_error=*/nullptr);
  fewer.resize(count / 3);
  return fewer;
}

/// IEC 61966-2-1.
const std::array<std::uint8_t, 256>& linear_of_srgb() {
  static const auto table = [] {
    std::array<std::uint8_t, 256> all{};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double s = static_cast<double>(i) / 255.0;
      const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
      all[i] = static_cast<std::uint8_t>(std::lround(255.0 * linear));
    }
    return all;
  }();
  return table;
}

class ViewVertices {
 public:
  ViewVertices(const Mesh& mesh, const CornerVertices& corners) : mesh_(mesh), corners_(corners) {
    if (mesh.normals.size() != mesh.vertices.size()) normals_ = vertex_normals(mesh);
    low_ = high_ = mesh.vertices.front();
    for (const Eigen::Vector3f& vertex : mesh.vertices) {
      low_ = low_.cwiseMin(vertex);
      high_ = high_.cwiseMax(vertex);
    }
    step_mm_ = std::max((high_ - low_).maxCoeff(), 1e-3F) / kSteps;
  }
  [[nodiscard]] ViewVertex operator()(std::uint32_t corner) const {
    const std::uint32_t v = corners_.vertex[corner];
    const auto& normals = normals_.empty() ? mesh_.normals : normals_;
    ViewVertex one;
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      one.position[i] = static_cast<std::uint16_t>(std::lround((mesh_.vertices[v][k] - low_[k]) / step_mm_));
      one.normal[i] = static_cast<std::int8_t>(std::lround(127.0F * std::clamp(normals[v][k], -1.0F, 1.0F)));
    }
    for (int k = 0; k < 2; ++k) {
      one.uv[static_cast<std::size_t>(k)] =
          static_cast<std::uint16_t>(std::lround(65535.0F * std::clamp(corners_.uv[corner][k], 0.0F, 1.0F)));
    }
    if (v < mesh_.colour.size()) {
      for (std::size_t k = 0; k < 3; ++k) one.colour[k] = linear_of_srgb()[mesh_.colour[v][k]];
      one.colour[3] = 255;
    }
    one.views[0] = v < mesh_.views.size() ? mesh_.views[v] : std::uint8_t{0};
    const float sigma = v < mesh_.sigma.size() ? mesh_.sigma[v] : NAN;
    one.sigma[0] = std::isfinite(sigma)
                       ? static_cast<std::uint16_t>(std::lround(std::clamp(kSigmaPerMm * sigma, 0.0F, kSteps - 1.0F)))
                       : kSigmaUnknown;
    return one;
  }
  [[nodiscard]] json node() const {
    const double scale = kMetresPerMm * step_mm_;
    return {{"mesh", 0},
            {"name", "model"},
            {"scale", {scale, scale, scale}},
            {"translation", {kMetresPerMm * low_.x(), kMetresPerMm * low_.y(), kMetresPerMm * low_.z()}}};
  }
  [[nodiscard]] json greatest() const {
    json greatest = json::array();
    for (int k = 0; k < 3; ++k) greatest.push_back(std::lround((high_[k] - low_[k]) / step_mm_));
    return greatest;
  }

 private:
  const Mesh& mesh_;
  const CornerVertices& corners_;
  std::vector<Eigen::Vector3f> normals_;
  Eigen::Vector3f low_, high_;
  float step_mm_ = 1.0F;
};

json add_geometry(const TexturedMesh& model, bool textured, std::size_t max_faces, GlbDocument& document) {
  const CornerVertices corners(model);
  std::vector<Eigen::Vector3f> positions;
  for (const auto v : corners.vertex) positions.push_back(model.mesh.vertices[v]);
  auto faces = fewer_faces(corners, positions, max_faces);
  // Vertices in the order of their first use, unused ones left out.
  std::vector<unsigned> place(positions.size());
  const std::size_t count =
      meshopt_optimizeVertexFetchRemap(place.data(), faces.front().data(), 3 * faces.size(), positions.size());
  meshopt_remapIndexBuffer(faces.front().data(), faces.front().data(), 3 * faces.size(), place.data());
  const ViewVertices vertex(model.mesh, corners);
  std::vector<ViewVertex> vertices(count);
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    if (place[i] < count) vertices[place[i]] = vertex(i);
  }
  std::string bytes;
  for (const ViewVertex& one : vertices) append_bytes(bytes, one);
  const int view = document.add_view(bytes, kGltfArrayBuffer, static_cast<int>(sizeof(ViewVertex)));
  json attributes;
  const auto add = [&](const char* name, std::size_t offset, int component, const char* type, bool normalized) {
    const int accessor = document.add_accessor(view, offset, component, count, type);
    if (normalized) document.accessor(accessor)["normalized"] = true;
    attributes[name] = accessor;
  };
  add("POSITION", offsetof(ViewVertex, position), kGltfUshort, "VEC3", false);
  document.accessor(attributes["POSITION"])["min"] = {0, 0, 0};
  document.accessor(attributes["POSITION"])["max"] = vertex.greatest();
  add("NORMAL", offsetof(ViewVertex, normal), kGltfByte, "VEC3", true);
  if (textured) add("TEXCOORD_0", offsetof(ViewVertex, uv), kGltfUshort, "VEC2", true);
  if (!textured && model.mesh.colour.size() == model.mesh.vertices.size())
    add("COLOR_0", offsetof(ViewVertex, colour), kGltfUbyte, "VEC4", true);
  add("_VIEWS", offsetof(ViewVertex, views), kGltfUbyte, "SCALAR", false);
  add("_SIGMA", offsetof(ViewVertex, sigma), kGltfUshort, "SCALAR", false);
  document.gltf["nodes"] = {vertex.node()};
  const int indices = document.add(faces, kGltfUint, "SCALAR", 3, kGltfElementArrayBuffer);
  return {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
}

}  // namespace

Result<std::string> encode_view_glb(const TexturedMesh& model, const ViewModelOptions& options) {
  if (model.mesh.faces.empty()) return fail(ErrorCode::degenerate, "glTF: the model has no faces");
  const bool textured = !model.atlas.empty() && model.corner_uv.size() == model.mesh.faces.size();
  GlbDocument document;
  document.gltf["extensionsUsed"] = document.gltf["extensionsRequired"] = {"KHR_mesh_quantization"};
  document.gltf["meshes"] = {{{"primitives", {add_geometry(model, textured, options.max_faces, document)}}}};
  if (options.other_rest) {
    const Eigen::Quaterniond& q = *options.other_rest;
    document.gltf["nodes"][0]["extras"]["other_rest"] = {q.x(), q.y(), q.z(), q.w()};
  }
  if (textured) {
    cv::Mat3b atlas = model.atlas;
    if (atlas.cols > options.texture_px)
      cv::resize(atlas, atlas, {options.texture_px, options.texture_px}, 0, 0, cv::INTER_AREA);
    if (auto added = document.add_texture(atlas, kViewJpegQuality); !added) return pass_on(added);
  }
  return document.file();
}

}  // namespace scanrig
