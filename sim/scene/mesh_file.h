#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/result.h"
#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// A mesh as in a file. Vertices at the same place are one vertex; differences there are kept by corner.
struct MeshFile {
  TriangleMesh mesh;
  std::vector<std::array<Eigen::Vector2f, 3>> corners;  ///< texture coordinates by triangle, (0,0) lower left; or empty
  std::vector<Eigen::Vector3f> colours;                 ///< linear RGB by vertex; or empty
  cv::Mat image;                                        ///< 8 bit BGR; or empty
};

/// Each fails with `not_found`, `io`, `invalid_input`, naming the file.
Result<MeshFile> read_obj(const std::filesystem::path& file);
Result<MeshFile> read_ply(const std::filesystem::path& file);
Result<MeshFile> read_glb(const std::filesystem::path& file);

/// Merges vertices at the same place and drops triangles without three different corners.
void weld(MeshFile& file);

}  // namespace scanrig::sim
