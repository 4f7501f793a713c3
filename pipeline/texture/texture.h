#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <span>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/texture/rig_light.h"

namespace scanrig {

/// One plain exposure (projector off), as the camera took it.
struct Photo {
  Camera camera;
  Transform turntable_from_model = Transform::Identity();  ///< rot_y(table angle) * pose_from_model
  cv::Mat3b image;  ///< BGR, linear light, lens distortion included, pixel centres at integers
};

struct TextureOptions {
  int atlas_px = 4096;              ///< side of the square atlas
  double max_texels_per_px = 2.0;   ///< of a photo's pixel; less where the charts would not fit
  int padding_px = 4;               ///< each chart's colour goes on this far beyond its faces
  double edge_px = 1.5;             ///< pixels this near to a depth edge are not used ...
  double edge_fade_px = 12.0;       ///< ... and the next ones fade in over this width
  double max_incidence_deg = 75.0;  ///< a photo says nothing about surface seen more flatly than this
};

struct TexturedModel {
  TexturedMesh mesh;           ///< a copy of the input with texture and with vertex colours (sRGB)
  RigLight light;              ///< of the rig, taken out of the texture
  double exposure_gain = 1.0;  ///< linear texture value = gain * photo value / light
  double texels_per_px = 0.0;  ///< of the atlas, against a photo's pixel
  std::size_t charts = 0;
  double seen_share = 0.0;  ///< of the area; the rest is filled from its surroundings
};

/// Colours `mesh` (mm, model frame) from `photos`; the order of the photos does not matter much, their number is at
/// least 1. Each texel is a blend of all photos that see its point of the surface, so chart borders carry no seam.
/// Triangles may have any size. Stages reported: "texture".
/// Fails with `degenerate` (no faces, or no photo sees the mesh), `invalid_input` (no photos, a photo without image or
/// of another size than its camera, an option out of range), `stopped`, `out_of_range` (more charts than the atlas can
/// hold).
Result<TexturedModel> texture_mesh(const Mesh& mesh, std::span<const Photo> photos, const TextureOptions& options,
                                   const Context& context);

}  // namespace scanrig
