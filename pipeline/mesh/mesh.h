#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

/// A triangle mesh, mm, counter-clockwise seen from outside. Attribute vectors are empty or have one entry per vertex.
struct Mesh {
  using Face = std::array<std::uint32_t, 3>;
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Face> faces;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::uint8_t>
      views;                 ///< number of views that measured the vertex; 0: closed by the visual hull or the table
  std::vector<float> sigma;  ///< standard deviation along the normal, mm; NaN where views is 0
  std::vector<std::array<std::uint8_t, 3>> colour;  ///< RGB
};

/// A mesh whose faces carry their own texture coordinates, so that the geometry stays one closed surface.
struct TexturedMesh {
  Mesh mesh;
  std::vector<std::array<Eigen::Vector2f, 3>> corner_uv;  ///< one per face; origin top left, 0..1 (glTF)
  cv::Mat3b atlas;                                        ///< BGR, 8 bit, sRGB
};

}  // namespace scanrig
