#include "pipeline/texture/texture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

#include "core/parallel.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/texture/atlas.h"
#include "pipeline/texture/chart_cutting.h"
#include "pipeline/texture/face_colours.h"
#include "pipeline/texture/filled_image.h"
#include "pipeline/texture/photo_check.h"
#include "pipeline/texture/photo_view.h"
#include "pipeline/texture/point_colour.h"
#include "pipeline/texture/shading.h"

namespace scanrig {
namespace {

Result<void> check(const Mesh& mesh, std::span<const Photo> photos, const TextureOptions& options) {
  if (mesh.faces.empty()) return fail(ErrorCode::degenerate, "texture: the mesh has no faces");
  if (!std::all_of(mesh.vertices.begin(), mesh.vertices.end(), [](const auto& v) { return v.allFinite(); })) {
    return fail(ErrorCode::invalid_input, "texture: the mesh has a vertex that is not a number");
  }
  if (photos.empty()) return fail(ErrorCode::invalid_input, "texture: no photos");
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const Projection& projection = photos[p].camera.projection;
    const cv::Rect sensor(0, 0, projection.width, projection.height), part(photos[p].first, photos[p].image.size());
    if (part.empty() || (part & sensor) != part || (photos[p].first == cv::Point() && part != sensor)) {
      return fail(ErrorCode::invalid_input, "texture: photo {} is {} x {}, its camera {} x {}", p, photos[p].image.cols,
                  photos[p].image.rows, projection.width, projection.height);
    }
  }
  if (options.atlas_px < 16 || options.atlas_px > 32768 || !(options.max_texels_per_px > 0.0) ||
      options.padding_px < 0 || !(options.edge_px >= 0.0) || !(options.edge_fade_px > 0.0) ||
      !(options.max_incidence_deg > 0.0 && options.max_incidence_deg < 90.0)) {
    return fail(ErrorCode::invalid_input, "texture: an option is out of range");
  }
  return {};
}

/// One gain for the whole scan that makes the brightest paint a suitable white.
double gain_for(const std::vector<PointColour>& colours, const TextureOptions& options) {
  std::vector<float> brightest;
  for (const auto& c : colours) {
    if (c.weight > 0.0F) brightest.push_back(c.bgr.maxCoeff());
  }
  return white_gain(std::move(brightest), options.white);
}

/// Colour of texels without a face: harmless where a viewer's coarser levels reach beyond the padding.
Eigen::Vector3f mean_colour(const std::vector<PointColour>& colours) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const auto& c : colours) sum += c.bgr;
  return sum / static_cast<float>(colours.size());
}

/// Colour of the texel (x, y), which the face `f` owns and `colours` has chosen.
cv::Vec3b texel_colour(const AtlasLayout& layout, const TexturedModel& model,
                       const std::vector<PointColour>& at_vertices, const TextureOptions& options, FaceColours& colours,
                       std::size_t f, int x, int y) {
  const auto gain = static_cast<float>(model.exposure_gain);
  const Eigen::Vector3d weights =
      barycentric(layout.corners[f], Eigen::Vector2d(x, y)).value_or(Eigen::Vector3d(1, 0, 0));
  // Beyond its rim a chart continues in the plane of the face, but with the light and the fill of the rim.
  const Eigen::Vector3d inside = weights.cwiseMax(0.0) / weights.cwiseMax(0.0).sum();
  Eigen::Vector3f fill = Eigen::Vector3f::Zero();
  for (int k = 0; k < 3; ++k) {
    fill += static_cast<float>(inside[k]) * at_vertices[model.mesh.mesh.faces[f][static_cast<std::size_t>(k)]].bgr;
  }
  const PointColour seen = colours.at(weights, inside);
  return to_srgb(gain * (seen.weight * seen.bgr + options.fill_weight * fill) / (seen.weight + options.fill_weight));
}

double seen_share(const Mesh& mesh, const std::vector<PointColour>& colours) {
  double all = 0.0;
  double seen = 0.0;
  for (const auto& [a, b, c] : mesh.faces) {
    const double area =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).cast<double>().norm();
    all += area;
    if (colours[a].weight > 0.0F && colours[b].weight > 0.0F && colours[c].weight > 0.0F) seen += area;
  }
  return seen / std::max(all, 1e-12);
}

struct VertexPaint {
  VertexLooks looks;
  std::vector<PointColour> colours;  ///< linear; unseen vertices are filled from their surroundings
};

/// Leaves contradicted photos out of `views`. Fills in the model's light, gain, seen share and vertex colours.
Result<VertexPaint> colour_vertices(std::span<PhotoView> views, const TextureOptions& options, TexturedModel& model) {
  Mesh& mesh = model.mesh.mesh;
  model.light = light_from_photos(views, mesh, mesh.normals, options.blending);
  model.contradicted = leave_out_contradicted(views, model.light, mesh, mesh.normals, options.blending, options.check);
  if (!model.contradicted.empty()) model.light = light_from_photos(views, mesh, mesh.normals, options.blending);
  VertexPaint paint{VertexLooks(views, model.light, mesh), std::vector<PointColour>(mesh.vertices.size())};
  std::vector<PointColour>& colours = paint.colours;
  for_each_in_blocks(colours.size(),
                     [&](std::size_t v) { colours[v] = blend_looks(views, paint.looks.of(v), options.blending); });
  if (std::none_of(colours.begin(), colours.end(), [](const PointColour& c) { return c.weight > 0.0F; })) {
    return fail(ErrorCode::degenerate, "texture: no photo sees the mesh; check the calibration");
  }
  model.seen_share = seen_share(mesh, colours);
  model.exposure_gain = gain_for(colours, options);
  fill_unseen(mesh, options.blending.fill_rounds, colours);
  mesh.colour.resize(colours.size());
  for_each_in_blocks(colours.size(), [&](std::size_t v) {
    const cv::Vec3b bgr = to_srgb(static_cast<float>(model.exposure_gain) * colours[v].bgr);
    mesh.colour[v] = {bgr[2], bgr[1], bgr[0]};
  });
  return paint;
}

/// Draws the atlas, face after face, and fills in the texture coordinates.
void draw_atlas(const AtlasLayout& layout, std::span<const PhotoView> views, const VertexPaint& paint,
                const TextureOptions& options, TexturedModel& model) {
  const int side = options.atlas_px;
  const auto gain = static_cast<float>(model.exposure_gain);
  model.mesh.atlas = filled_image<cv::Vec3b>({side, side}, to_srgb(gain * mean_colour(paint.colours)));
  model.mesh.corner_uv.resize(layout.corners.size());
  for_blocks(layout.corners.size(), [&](std::size_t begin, std::size_t end) {
    FaceColours of_face(views, model.light, model.mesh.mesh, paint.looks, options.blending);
    for (std::size_t f = begin; f < end; ++f) {
      of_face.choose(static_cast<std::uint32_t>(f));
      const cv::Rect box = layout.box_of(f);
      for (int y = box.y; y < box.br().y; ++y) {
        for (int x = box.x; x < box.br().x; ++x) {
          if (layout.owner(y, x) != static_cast<int>(f)) continue;
          model.mesh.atlas(y, x) = texel_colour(layout, model, paint.colours, options, of_face, f, x, y);
        }
      }
      for (std::size_t k = 0; k < 3; ++k) {
        // A texel's centre is half a texel from its corner, and (0, 0) is the corner of the first.
        model.mesh.corner_uv[f][k] = ((layout.corners[f][k].array() + 0.5) / side).matrix().cast<float>();
      }
    }
  });
}

}  // namespace

Result<TexturedModel> texture_mesh(const Mesh& mesh, std::span<const Photo> photos, const TextureOptions& options,
                                   const Context& context) {
  if (auto good = check(mesh, photos, options); !good) return pass_on(good);
  const auto stopped = [] { return fail(ErrorCode::stopped, "texture: stopped"); };

  TexturedModel model;
  Mesh& out = model.mesh.mesh;
  out = mesh;
  if (out.normals.size() != out.vertices.size()) out.normals = vertex_normals(out);

  const double px_per_mm = typical_px_per_mm(mesh, photos);
  std::vector<std::optional<PhotoView>> made(photos.size());
  parallel_for(made.size(), [&](std::size_t p) {
    if (!context.stopped()) made[p].emplace(photos[p], out, options, px_per_mm);
  });
  if (context.stopped()) return stopped();
  std::vector<PhotoView> views;
  for (auto& view : made) views.push_back(std::move(*view));
  context.report("texture", 0.3);

  const auto paint = colour_vertices(views, options, model);
  if (!paint) return pass_on(paint);
  context.report("texture", 0.4);
  if (context.stopped()) return stopped();

  const auto flat = chart_views(views, px_per_mm);
  const auto charts = cut_into_charts(out, flat, views.size(), paint->looks, options.charts);
  const auto layout = lay_out(out, flat, charts, options.atlas_px, options.max_texels_per_px, options.padding_px);
  if (!layout) {
    return fail(ErrorCode::out_of_range,
                "texture: {} charts do not fit into an atlas of {} pixels; choose a larger one", charts.size(),
                options.atlas_px);
  }
  model.charts = charts.size();
  model.texels_per_px = layout->texels_per_px;
  context.report("texture", 0.5);
  if (context.stopped()) return stopped();

  draw_atlas(*layout, views, *paint, options, model);
  context.report("texture", 1.0);
  return model;
}

}  // namespace scanrig
