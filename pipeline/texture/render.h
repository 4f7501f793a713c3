#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/texture/rig_light.h"

namespace scanrig {

enum class Paint {
  texture,        ///< the atlas
  vertex_colour,  ///< Mesh::colour
  grey,           ///< plain grey, lit from above the camera: shows the shape
};

/// The light and the exposure of a scan's plain photos, from texture_mesh: TexturedModel::light, ::exposure_gain.
struct Exposure {
  RigLight light;
  double gain = 1.0;
};

struct RenderOptions {
  Paint surface = Paint::texture;
  int supersample = 1;  ///< n x n rays per pixel, their light averaged
  /// Only where a neighbour has another colour; any other pixel takes the ray through its centre.
  bool smooth_edges_only = false;
  cv::Vec3b background{0, 0, 0};
  /// Present: the image is linear light under the rig's lamps, for comparison with a photo. Absent: sRGB, unlit.
  std::optional<Exposure> as_photo = std::nullopt;
};

/// All matrices have the camera's size.
struct Rendering {
  cv::Mat3b image;  ///< BGR
  cv::Mat1f depth;  ///< z in the camera frame, mm, at the pixel's centre; NaN without mesh
  cv::Mat1b mask;   ///< 255 where the pixel's centre shows the mesh
};

/// Draws a mesh into calibrated cameras, lens distortion included.
/// Threads: render may be called from any.
class MeshRenderer {
 public:
  /// A mesh without texture is given as TexturedMesh{mesh, {}, {}}. Fails with `degenerate` (no face).
  static Result<MeshRenderer> create(TexturedMesh mesh);

  /// Fails with `invalid_input` when the mesh lacks the data of the requested surface, or supersample is not in 1..16.
  Result<Rendering> render(const Camera& camera, const Transform& turntable_from_model,
                           const RenderOptions& options = {}) const;

 private:
  MeshRenderer(TexturedMesh mesh, SurfaceIndex scene);
  [[nodiscard]] Eigen::Vector3f paint(const SurfaceIndex::Hit& hit, Paint surface) const;
  [[nodiscard]] Eigen::Vector3f normal(const SurfaceIndex::Hit& hit) const;

  TexturedMesh mesh_;
  SurfaceIndex scene_;
};

}  // namespace scanrig
