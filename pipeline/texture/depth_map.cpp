#include "pipeline/texture/depth_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/calibration/distortion_table.h"
#include "pipeline/texture/four_lanes.h"
#include "pipeline/texture/rounding.h"

namespace scanrig {
namespace {

/// A vertex in the image: x, y, and 1 / z, because that is linear there. 1 / z = 0: behind the camera.
struct Corner {
  FourLanes place = {};

  [[nodiscard]] float x() const { return place[0]; }
  [[nodiscard]] float y() const { return place[1]; }
  [[nodiscard]] float inverse_depth() const { return place[2]; }
};

std::vector<Corner> corners_of(const Mesh& mesh, const Projection& projection, const Transform& camera_from_model) {
  std::vector<Corner> corners(mesh.vertices.size());
  for (std::size_t v = 0; v < corners.size(); ++v) {
    const Eigen::Vector3d p = camera_from_model * mesh.vertices[v].cast<double>();
    if (p.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = projection.project(p);
    corners[v].place =
        FourLanes{static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), static_cast<float>(1.0 / p.z()), 0.0F};
  }
  return corners;
}

cv::Rect window_of(const std::vector<Corner>& corners, const Projection& projection) {
  Eigen::AlignedBox2d box;
  for (const Corner& c : corners) {
    if (c.inverse_depth() > 0.0F) box.extend(Eigen::Vector2d(static_cast<double>(c.x()), static_cast<double>(c.y())));
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

FourLanes lower_of(const FourLanes& a, const FourLanes& b) { return a < b ? a : b; }
FourLanes higher_of(const FourLanes& a, const FourLanes& b) { return a > b ? a : b; }

/// The nearest surface so far, as 1 / z, at the pixels whose centres the face covers, borders included. Faces that
/// reach behind the camera are left out.
void draw_face(const Corner& a, const Corner& b, const Corner& c, const cv::Rect& window, cv::Mat1f& inverse_depth) {
  const FourLanes low = lower_of(lower_of(a.place, b.place), c.place);
  const FourLanes high = higher_of(higher_of(a.place, b.place), c.place);
  if (low[2] <= 0.0F) return;
  const int left = std::max(window.x, rounded_up(low[0])), right = std::min(window.br().x - 1, rounded_down(high[0]));
  const int top = std::max(window.y, rounded_up(low[1])), bottom = std::min(window.br().y - 1, rounded_down(high[1]));
  if (left > right || top > bottom) return;
  const double bx = b.x() - a.x(), by = b.y() - a.y(), cx = c.x() - a.x(), cy = c.y() - a.y(), area = bx * cy - by * cx;
  if (area == 0.0) return;
  constexpr double kBorder = -1e-6;  // a centre on an edge belongs to both of its faces
  // What is clearly outside or behind needs no division.
  const double side = area < 0.0 ? -1.0 : 1.0, outside = 2.0 * kBorder * side * area;
  const float behind = (1.0F + 1e-5F) * high[2];
  for (int y = top; y <= bottom; ++y) {
    float* row = inverse_depth[y - window.y];
    for (int x = left; x <= right; ++x) {
      float& nearest = row[x - window.x];
      if (nearest >= behind) continue;
      const double px = static_cast<double>(x) - static_cast<double>(a.x()),
                   py = static_cast<double>(y) - static_cast<double>(a.y());
      const double near_b = px * cy - py * cx, near_c = bx * py - by * px;
      if (std::min({side * near_b, side * near_c, side * (area - near_b - near_c)}) < outside) continue;
      const double at_b = near_b / area, at_c = near_c / area, at_a = 1.0 - at_b - at_c;
      if (at_a < kBorder || at_b < kBorder || at_c < kBorder) continue;
      const double nearness = at_a * static_cast<double>(a.inverse_depth()) +
                              at_b * static_cast<double>(b.inverse_depth()) +
                              at_c * static_cast<double>(c.inverse_depth());
      nearest = std::max(nearest, static_cast<float>(nearness));
    }
  }
}

}  // namespace

DepthMap draw_depth(const Mesh& mesh, const Projection& projection, const Transform& camera_from_model) {
  const std::vector<Corner> corners = corners_of(mesh, projection, camera_from_model);
  DepthMap map{.window = window_of(corners, projection), .depth = {}};
  cv::Mat1f inverse_depth(map.window.size(), 0.0F);
  for (const auto& [a, b, c] : mesh.faces) draw_face(corners[a], corners[b], corners[c], map.window, inverse_depth);
  map.depth = inverse_depth;
  for (float& value : map.depth) value = value > 0.0F ? 1.0F / value : std::numeric_limits<float>::quiet_NaN();
  return map;
}

}  // namespace scanrig
