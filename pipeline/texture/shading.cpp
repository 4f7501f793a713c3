#include "pipeline/texture/shading.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace scanrig {

cv::Vec3b to_srgb(const Eigen::Vector3f& linear) {
  cv::Vec3b encoded;
  for (int k = 0; k < 3; ++k) {
    const float v = std::clamp(linear[k], 0.0F, 1.0F);
    const float e = v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1.0F / 2.4F) - 0.055F;
    encoded[k] = static_cast<uchar>(std::lround(255.0F * e));
  }
  return encoded;
}

Eigen::Vector3f from_srgb(const cv::Vec3b& encoded) {
  static const auto table = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float e = static_cast<float>(i) / 255.0F;
      values[i] = e <= 0.04045F ? e / 12.92F : std::pow((e + 0.055F) / 1.055F, 2.4F);
    }
    return values;
  }();
  return {table[encoded[0]], table[encoded[1]], table[encoded[2]]};
}

std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.faces) {
    const Eigen::Vector3f across = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    for (const auto v : {a, b, c}) normals[v] += across;
  }
  for (auto& n : normals) n = n.squaredNorm() > 0.0F ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f::UnitY();
  return normals;
}

}  // namespace scanrig
