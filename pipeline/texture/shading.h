#pragma once

#include <Eigen/Core>
#include <opencv2/core/matx.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// 8-bit sRGB of linear values; 1 = white [IEC 61966-2-1]. The order of the channels stays.
cv::Vec3b to_srgb(const Eigen::Vector3f& linear);
Eigen::Vector3f from_srgb(const cv::Vec3b& encoded);

/// Unit normals, one a vertex: the faces' normals weighted by their areas.
std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh);

}  // namespace scanrig
