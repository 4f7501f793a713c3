#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/texture/rig_light.h"
#include "pipeline/texture/shading.h"

namespace scanrig {

/// One plain exposure (projector off), as the camera took it.
struct Photo {
  Camera camera;
  Transform turntable_from_model = Transform::Identity();  ///< rot_y(table angle) * pose_from_model
  cv::Mat3b image;       ///< BGR, linear light, lens distortion included, pixel centres at integers
  cv::Point first = {};  ///< of the image, on the sensor: it may be a part; the rest counts as black
  /// Photos of one layer are blended; where one of a lower layer shows the surface, those of higher ones are not used.
  /// For photos of which it is not known how they lie to the others.
  int layer = 0;
  /// Places, model frame, of what stood before the object and is not of the mesh: no colour is taken there.
  std::vector<Eigen::Vector3f> in_front{};
};

/// Cutting of the surface into charts.
struct ChartOptions {
  double good_share = 0.7;        ///< of the best photo's cosine: sufficient to flatten a face
  double min_gain = 0.002;        ///< of the seen area: minimum gain of a further view
  double min_facing = 0.2;        ///< cosine below which a photo does not flatten a face
  int smoothing_rounds = 10;      ///< of iterated conditional modes
  double border_cost = 0.5;       ///< of one edge between two labels, against a cosine lost of 1
  std::size_t small_chart = 200;  ///< faces: smaller charts join a neighbour where its view shows them ...
  std::size_t tiny_chart = 24;    ///< ... and still smaller ones where they only face that view
  int join_rounds = 3;            ///< of joining small charts
};

/// Blending of the photos' colours at one point.
struct BlendOptions {
  /// Difference from the majority at which a photo has half of its weight, relative to the colour, and in full scale.
  float outlier_share = 0.08F;
  float outlier_floor = 0.02F;
  std::array<float, 4> outlier_widths = {4.0F, 2.0F, 1.0F, 1.0F};  ///< factors on it, round after round
  float saturated_weight = 0.001F;                                 ///< factor for saturated pixels
  std::size_t light_spots = 20000;                                 ///< vertices from which the light is fitted
  int fill_rounds = 60;                                            ///< of smoothing on unseen surface
};

/// Search for photos that differ from all others.
struct PhotoCheckOptions {
  std::size_t spots = 60000;       ///< vertices that are compared
  int cells = 80;                  ///< across the photo's width
  std::size_t min_looks = 4;       ///< photos that show a spot, for it to be compared
  std::size_t min_cell_looks = 5;  ///< spots in a cell
  /// A cell is off if its median difference is this many times what the blending tolerates (outlier_share and _floor),
  /// and this many times what one cell in a hundred of the middle photo shows: gloss and cast shadows do that too.
  float min_off = 2.0F;
  float rare_factor = 2.5F;
  double rare_share = 0.01;
  float grown_off = 0.5F;   ///< neighbours of such a cell belong to it from this share of that difference
  double min_share = 0.01;  ///< of the object's area in the photo: smaller parts are left to the blending
  double max_share = 0.5;   ///< beyond it the photo is left out whole
};

/// A photo, or a part of it, that shows other colours than all others and was left out.
struct ContradictedPhoto {
  std::size_t photo = 0;    ///< in the order given
  double share = 0.0;       ///< of the object's area in it
  double brightness = 1.0;  ///< of that part, against the other photos: below 1 a shadow, above a reflection
  bool is_whole = false;    ///< nothing of it is used
};

struct TextureOptions {
  int atlas_px = 4096;              ///< side of the square atlas
  double max_texels_per_px = 2.0;   ///< of a photo's pixel; less where the charts would not fit
  int padding_px = 4;               ///< the colour of each chart continues this far beyond its faces
  double edge_px = 1.5;             ///< pixels this near to a depth edge are not used ...
  double edge_fade_px = 12.0;       ///< ... and the next ones fade in over this width
  double max_incidence_deg = 75.0;  ///< a photo gives no colour to surface seen more flatly than this
  int saturated = 250;              ///< grey level from which a pixel is no measurement
  /// Weight of the surrounding colour against the photos' (about 1 for a good view): significant only where they see
  /// next to nothing, and makes the passage to unseen surface continuous.
  float fill_weight = 1e-4F;
  WhiteOptions white{};
  ChartOptions charts{};
  BlendOptions blending{};
  PhotoCheckOptions check{};
};

struct TexturedModel {
  TexturedMesh mesh;           ///< a copy of the input with texture and with vertex colours (sRGB)
  RigLight light;              ///< of the rig, taken out of the texture
  double exposure_gain = 1.0;  ///< linear texture value = gain * photo value / light
  double texels_per_px = 0.0;  ///< of the atlas, against a photo's pixel
  std::size_t charts = 0;
  double seen_share = 0.0;  ///< of the area; the rest is filled from its surroundings
  std::vector<ContradictedPhoto> contradicted;
};

/// Colours `mesh` (mm, model frame) from `photos`; the order of the photos matters little, at least one is needed. Each
/// texel is a blend of all photos that see its point of the surface, so chart borders have no seam. Triangles may have
/// any size. Stages reported: "texture".
/// Fails with `degenerate` (no faces, or no photo sees the mesh), `invalid_input` (no photos, a photo without image or
/// of another size than its camera, an option out of range), `stopped`, `out_of_range` (more charts than fit into the
/// atlas).
Result<TexturedModel> texture_mesh(const Mesh& mesh, std::span<const Photo> photos, const TextureOptions& options,
                                   const Context& context);

}  // namespace scanrig
