#include "pipeline/texture/render.h"
#include "pipeline/mesh/solid_properties.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "pipeline/texture/photo_view.h"
#include "pipeline/texture/shading.h"

namespace scanrig {
namespace {

/// Colour between texel centres; uv as in glTF.
Eigen::Vector3f fetch(const cv::Mat3b& atlas, const Eigen::Vector2f& uv) {
  const float x = std::clamp(uv.x() * static_cast<float>(atlas.cols) - 0.5F, 0.0F, static_cast<float>(atlas.cols - 1));
  const float y = std::clamp(uv.y() * static_cast<float>(atlas.rows) - 0.5F, 0.0F, static_cast<float>(atlas.rows - 1));
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, atlas.cols - 1);
  const int y1 = std::min(y0 + 1, atlas.rows - 1);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  return (1.0F - fy) * ((1.0F - fx) * from_srgb(atlas(y0, x0)) + fx * from_srgb(atlas(y0, x1))) +
         fy * ((1.0F - fx) * from_srgb(atlas(y1, x0)) + fx * from_srgb(atlas(y1, x1)));
}

/// A lamp at the camera and a stronger one above it to the left.
float grey(const Eigen::Vector3d& normal_in_camera) {
  const Eigen::Vector3d lamp = Eigen::Vector3d(-0.5, -0.7, -0.6).normalized();
  return static_cast<float>(0.05 + 0.25 * std::max(0.0, -normal_in_camera.z()) +
                            0.5 * std::max(0.0, lamp.dot(normal_in_camera)));
}

cv::Vec3b to_linear_bytes(const Eigen::Vector3f& linear) {
  cv::Vec3b bytes;
  for (int k = 0; k < 3; ++k) {
    bytes[k] = static_cast<uchar>(std::lround(255.0F * std::clamp(linear[k], 0.0F, 1.0F)));
  }
  return bytes;
}

/// A neighbour to the right, left, below or above has clearly another colour.
bool is_at_edge(const cv::Mat3b& image, int y, int x) {
  constexpr int kLevels = 12;
  const cv::Vec3b& here = image(y, x);
  const auto differs = [&](int row, int column) {
    if (row < 0 || column < 0 || row >= image.rows || column >= image.cols) return false;
    const cv::Vec3b& there = image(row, column);
    return std::abs(here[0] - there[0]) > kLevels || std::abs(here[1] - there[1]) > kLevels ||
           std::abs(here[2] - there[2]) > kLevels;
  };
  return differs(y, x + 1) || differs(y, x - 1) || differs(y + 1, x) || differs(y - 1, x);
}

Result<void> check(const TexturedMesh& mesh, const RenderOptions& options) {
  if (options.supersample < 1 || options.supersample > 16) {
    return fail(ErrorCode::invalid_input, "render: {} x {} rays per pixel; choose 1 to 16", options.supersample,
                options.supersample);
  }
  if (options.surface == Paint::texture && (mesh.atlas.empty() || mesh.corner_uv.size() != mesh.mesh.faces.size())) {
    return fail(ErrorCode::invalid_input, "render: the mesh has no texture");
  }
  if (options.surface == Paint::vertex_colour && mesh.mesh.colour.size() != mesh.mesh.vertices.size()) {
    return fail(ErrorCode::invalid_input, "render: the mesh has no vertex colours");
  }
  return {};
}

}  // namespace

MeshRenderer::MeshRenderer(TexturedMesh mesh, SurfaceIndex scene) : mesh_(std::move(mesh)), scene_(std::move(scene)) {}

Result<MeshRenderer> MeshRenderer::create(TexturedMesh mesh) {
  auto scene = SurfaceIndex::create(mesh.mesh);
  if (!scene) return pass_on(scene, "render");
  if (mesh.mesh.normals.size() != mesh.mesh.vertices.size()) mesh.mesh.normals = vertex_normals(mesh.mesh);
  return MeshRenderer(std::move(mesh), std::move(*scene));
}

Eigen::Vector3f MeshRenderer::paint(const SurfaceIndex::Hit& hit, Paint surface) const {
  if (surface == Paint::texture) {
    const auto& uv = mesh_.corner_uv[hit.face];
    return fetch(mesh_.atlas, hit.weights[0] * uv[0] + hit.weights[1] * uv[1] + hit.weights[2] * uv[2]);
  }
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int k = 0; k < 3; ++k) {
    const auto& [red, green, blue] = mesh_.mesh.colour[mesh_.mesh.faces[hit.face][static_cast<std::size_t>(k)]];
    sum += hit.weights[k] * from_srgb(cv::Vec3b(blue, green, red));
  }
  return sum;
}

Eigen::Vector3f MeshRenderer::normal(const SurfaceIndex::Hit& hit) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int k = 0; k < 3; ++k) {
    sum += hit.weights[k] * mesh_.mesh.normals[mesh_.mesh.faces[hit.face][static_cast<std::size_t>(k)]];
  }
  return sum.normalized();
}

Result<Rendering> MeshRenderer::render(const Camera& camera, const Transform& turntable_from_model,
                                       const RenderOptions& options) const {
  if (const auto drawable = check(mesh_, options); !drawable) return pass_on(drawable);
  const Transform camera_from_model = camera.camera_from_turntable * turntable_from_model;
  const Eigen::Vector3d centre = camera_from_model.inverse().translation();
  const Eigen::Vector3f background =
      options.as_photo ? Eigen::Vector3f(options.background[0], options.background[1], options.background[2]) / 255.0F
                       : from_srgb(options.background);
  const auto shade = [&](const SurfaceIndex::Hit& hit, const Eigen::Vector3d& ray) -> Eigen::Vector3f {
    const Eigen::Vector3d n = normal(hit).cast<double>();
    if (options.surface == Paint::grey) return Eigen::Vector3f::Constant(grey(camera_from_model.linear() * n));
    const Eigen::Vector3f colour = paint(hit, options.surface);
    if (!options.as_photo) return colour;
    const Eigen::Vector3d point = turntable_from_model * (centre + hit.distance * ray);
    const Eigen::Vector3f lit = options.as_photo->light.at(turntable_from_model.linear() * n, point);
    return colour.cwiseProduct(lit) / static_cast<float>(options.as_photo->gain);
  };

  const cv::Size size(camera.projection.width, camera.projection.height);
  Rendering out{cv::Mat3b(size, options.background), cv::Mat1f(size, std::numeric_limits<float>::quiet_NaN()),
                cv::Mat1b(size, uchar{0})};
  const auto cast = [&](double u, double v) {
    const Eigen::Vector3d ray = camera_from_model.linear().transpose() * camera.ray({u, v});
    return std::pair(scene_.first_hit(centre, ray), ray);
  };
  const auto to_bytes = [&](const Eigen::Vector3f& linear) {
    return options.as_photo ? to_linear_bytes(linear) : to_srgb(linear);
  };
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size.width; ++x) {
      const auto [hit, ray] = cast(x, y);
      out.image(y, x) = to_bytes(hit ? shade(*hit, ray) : background);
      if (!hit) continue;
      out.depth(y, x) = static_cast<float>(hit->distance);
      out.mask(y, x) = 255;
    }
  });
  const int n = options.supersample;
  if (n == 1) return out;
  const cv::Mat3b once = options.smooth_edges_only ? out.image.clone() : cv::Mat3b();
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size.width; ++x) {
      if (options.smooth_edges_only && !is_at_edge(once, y, x)) continue;
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int k = 0; k < n * n; ++k) {
        const int column = k % n, line = k / n;
        const auto [hit, ray] = cast(x + (column + 0.5) / n - 0.5, y + (line + 0.5) / n - 0.5);
        sum += hit ? shade(*hit, ray) : background;
      }
      out.image(y, x) = to_bytes(sum / static_cast<float>(n * n));
    }
  });
  return out;
}

}  // namespace scanrig
