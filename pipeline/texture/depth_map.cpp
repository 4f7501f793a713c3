#include "pipeline/texture/depth_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/calibration/distortion_table.h"

namespace scanrig {
namespace {

/// A vertex in the image; 1 / z, because that is linear there. 0: behind the camera.
struct Corner {
  float x = 0.0F, y = 0.0F, inverse_depth = 0.0F;
};

std::vector<Corner> corners_of(const Mesh& mesh, const Projection& projection, const Transform& camera_from_model) {
  std::vector<Corner> corners(mesh.vertices.size());
  for (std::size_t v = 0; v < corners.size(); ++v) {
    const Eigen::Vector3d p = camera_from_model * mesh.vertices[v].cast<double>();
    if (p.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = projection.project(p);
    corners[v] = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), static_cast<float>(1.0 / p.z())};
  }
  return corners;
}

cv::Rect window_of(const std::vector<Corner>& corners, const Projection& projection) {
  Eigen::AlignedBox2d box;
  for (const Corner& c : corners) {
    if (c.inverse_depth > 0.0F) box.extend(Eigen::Vector2d(static_cast<double>(c.x), static_cast<double>(c.y)));
  }
  if (box.isEmpty()) return {};
  const double margin = DistortionTable::kMargin * projection.width;
  const Eigen::Array2d lowest = Eigen::Array2d::Constant(-margin);
  const Eigen::Array2d highest = Eigen::Array2d(projection.width, projection.height) + margin;
  const Eigen::Array2d low = box.min().array().floor().max(lowest).min(highest) - 2.0;
  const Eigen::Array2d high = box.max().array().ceil().max(lowest).min(highest) + 3.0;
  return {cv::Point(static_cast<int>(low.x()), static_cast<int>(low.y())),
          cv::Point(static_cast<int>(high.x()), static_cast<int>(high.y()))};
}

/// The nearest surface so far, as 1 / z, at the pixels whose centres the face covers, borders included.
void draw_face(const Corner& a, const Corner& b, const Corner& c, const cv::Rect& window, cv::Mat1f& inverse_depth) {
  const int left = std::max(window.x, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}))));
  const int right = std::min(window.br().x - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}))));
  const int top = std::max(window.y, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}))));
  const int bottom = std::min(window.br().y - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}))));
  if (left > right || top > bottom) return;
  const double bx = b.x - a.x, by = b.y - a.y, cx = c.x - a.x, cy = c.y - a.y, area = bx * cy - by * cx;
  if (area == 0.0) return;
  constexpr double kBorder = -1e-6;  // a centre on an edge belongs to both of its faces
  for (int y = top; y <= bottom; ++y) {
    float* row = inverse_depth[y - window.y];
    for (int x = left; x <= right; ++x) {
      const double px = static_cast<double>(x) - static_cast<double>(a.x),
                   py = static_cast<double>(y) - static_cast<double>(a.y);
      const double at_b = (px * cy - py * cx) / area, at_c = (bx * py - by * px) / area, at_a = 1.0 - at_b - at_c;
      if (at_a < kBorder || at_b < kBorder || at_c < kBorder) continue;
      const double nearness = at_a * static_cast<double>(a.inverse_depth) +
                              at_b * static_cast<double>(b.inverse_depth) + at_c * static_cast<double>(c.inverse_depth);
      float& nearest = row[x - window.x];
      nearest = std::max(nearest, static_cast<float>(nearness));
    }
  }
}

}  // namespace

DepthMap draw_depth(const Mesh& mesh, const Projection& projection, const Transform& camera_from_model) {
  const std::vector<Corner> corners = corners_of(mesh, projection, camera_from_model);
  DepthMap map{.window = window_of(corners, projection), .depth = {}};
  cv::Mat1f inverse_depth(map.window.size(), 0.0F);
  for (const Mesh::Face& face : mesh.faces) {
    const Corner &a = corners[face[0]], &b = corners[face[1]], &c = corners[face[2]];
    if (std::min({a.inverse_depth, b.inverse_depth, c.inverse_depth}) <= 0.0F) continue;
    draw_face(a, b, c, map.window, inverse_depth);
  }
  map.depth = cv::Mat1f(map.window.size());
  for (int y = 0; y < inverse_depth.rows; ++y) {
    for (int x = 0; x < inverse_depth.cols; ++x) {
      const float nearness = inverse_depth(y, x);
      map.depth(y, x) = nearness > 0.0F ? 1.0F / nearness : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return map;
}

}  // namespace scanrig
