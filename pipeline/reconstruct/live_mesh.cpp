#include "pipeline/reconstruct/live_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pipeline/mesh/solid_properties.h"
#include "pipeline/texture/shading.h"

namespace scanrig {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

constexpr Rgb kGrey = {150, 150, 150};
constexpr double kMaxStep = 4.0;    // edge of a triangle over the grid's spacing
constexpr double kSameDepth = 1.5;  // mm between a vertex and what a view sees there

constexpr std::size_t kGainSamples = 2000;

/// What the photograph shows of a point, linear; nothing outside of it.
std::optional<Eigen::Vector3f> light_at(const Camera& left, const LivePhoto& photo,
                                        const Eigen::Vector3d& point_in_pose) {
  if (photo.image.empty()) return std::nullopt;
  const Eigen::Vector2d pixel = left.project(photo.turntable_from_pose * point_in_pose);
  if (!pixel.allFinite() || !left.projection.contains(pixel)) return std::nullopt;
  const cv::Vec3b bgr = photo.image(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x())));
  return Eigen::Vector3f(bgr[0], bgr[1], bgr[2]) / 255.0F;
}

Rgb colour_at(const Camera& left, const LivePhoto& photo, const Eigen::Vector3d& point_in_pose) {
  const auto light = light_at(left, photo, point_in_pose);
  if (!light) return kGrey;
  const cv::Vec3b bgr = to_srgb(static_cast<float>(photo.gain) * *light);
  return {bgr[2], bgr[1], bgr[0]};
}

/// Smallest step of a grid that has at most `max_vertices` measured pixels.
int grid_step(const cv::Mat1f& depth, std::size_t max_vertices) {
  for (int step = 1;; ++step) {
    std::size_t count = 0;
    for (int v = 0; v < depth.rows; v += step) {
      for (int u = 0; u < depth.cols; u += step) count += std::isfinite(depth(v, u)) ? 1 : 0;
    }
    if (count <= max_vertices) return step;
  }
}

/// Corners of a face are joined where none is further from the next than a surface at this spacing can be.
void add_face(Mesh& mesh, const Mesh::Face& face, float max_edge_mm) {
  for (std::size_t k = 0; k < 3; ++k) {
    if ((mesh.vertices[face[k]] - mesh.vertices[face[(k + 1) % 3]]).norm() > max_edge_mm) return;
  }
  mesh.faces.push_back(face);
}

}  // namespace

double live_gain(const View& view, const Camera& left, const LivePhoto& photo) {
  const RangeImage& range = view.range;
  const int step = grid_step(range.depth, kGainSamples);
  const Transform pose_from_camera = range.camera_from_pose.inverse();
  std::vector<float> brightness;
  for (int v = 0; v < range.depth.rows; v += step) {
    for (int u = 0; u < range.depth.cols; u += step) {
      if (!std::isfinite(range.depth(v, u))) continue;
      const auto light = light_at(left, photo, pose_from_camera * range.projection.unproject(u, v, range.depth(v, u)));
      if (light) brightness.push_back(light->maxCoeff());
    }
  }
  return white_gain(std::move(brightness));
}

Mesh live_mesh_of_view(const View& view, const Camera& left, const LivePhoto& photo, std::size_t max_vertices) {
  const RangeImage& range = view.range;
  const int step = grid_step(range.depth, max_vertices);
  const Transform pose_from_camera = range.camera_from_pose.inverse();
  const int columns = (range.depth.cols + step - 1) / step;
  const int rows = (range.depth.rows + step - 1) / step;
  Mesh mesh;
  cv::Mat1i vertex(rows, columns, -1);
  float spacing_mm = 0.0F;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float depth = range.depth(row * step, column * step);
      if (!std::isfinite(depth)) continue;
      const Eigen::Vector3d point = pose_from_camera * range.projection.unproject(column * step, row * step, depth);
      vertex(row, column) = static_cast<int>(mesh.vertices.size());
      mesh.vertices.emplace_back(point.cast<float>());
      mesh.colour.push_back(colour_at(left, photo, point));
      spacing_mm = std::max(spacing_mm, static_cast<float>(step * range.projection.mm_per_pixel(depth)));
    }
  }
  const float max_edge_mm = static_cast<float>(kMaxStep) * spacing_mm;
  const auto join = [&](int a, int b, int c) {
    if (a < 0 || b < 0 || c < 0) return;
    add_face(mesh, {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)},
             max_edge_mm);
  };
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const int here = vertex(row, column), right = vertex(row, column + 1);
      const int below = vertex(row + 1, column), across = vertex(row + 1, column + 1);
      join(here, below, right);
      join(right, below, across);
    }
  }
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

void colour_by_views(Mesh& mesh, const std::vector<View>& views, const Camera& left,
                     const std::function<LivePhoto(std::size_t)>& photo_of) {
  mesh.colour.assign(mesh.vertices.size(), kGrey);
  std::vector<double> max_directness(mesh.vertices.size(), 0.0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const RangeImage& range = views[i].range;
    const LivePhoto photo = photo_of(i);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Eigen::Vector3d point = mesh.vertices[v].cast<double>();
      const Eigen::Vector3d in_camera = range.camera_from_pose * point;
      const Eigen::Vector2d pixel = range.projection.project(in_camera);
      if (!pixel.allFinite() || !range.projection.contains(pixel)) continue;
      const float depth =
          range.depth(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x())));
      if (!(std::abs(depth - in_camera.z()) < kSameDepth)) continue;
      const Eigen::Vector3d normal = range.camera_from_pose.linear() * mesh.normals[v].cast<double>();
      const double directness = -normal.dot(in_camera.normalized());
      if (directness <= max_directness[v]) continue;
      max_directness[v] = directness;
      mesh.colour[v] = colour_at(left, photo, point);
    }
  }
}

}  // namespace scanrig
