#include "pipeline/texture/point_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/parallel_blocks.h"
#include "pipeline/mesh/vertex_neighbours.h"

namespace scanrig {

PaintSample paint_in(const PhotoView& view, const Eigen::Vector2f& pixel, float weight, const Eigen::Vector3f& light,
                     const BlendOptions& options) {
  const Sample sample = view.sample(pixel);
  return {sample.bgr.cwiseQuotient(light), sample.saturated ? options.saturated_weight * weight : weight};
}

PointColour majority(std::span<const PaintSample> samples, const BlendOptions& options) {
  if (samples.empty()) return {};
  Eigen::Vector3f best = Eigen::Vector3f::Zero();
  float weight = 0.0F;
  for (const PaintSample& sample : samples) {
    best += sample.weight * sample.bgr;
    weight += sample.weight;
  }
  best /= weight;
  // From wide to narrow, so that the majority is found without a jump anywhere on the surface.
  for (const float width : options.outlier_widths) {
    const float limit = width * (options.outlier_floor + options.outlier_share * best.maxCoeff());
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float total = 0.0F;
    for (const PaintSample& sample : samples) {
      const float off = (sample.bgr - best).squaredNorm() / (limit * limit);
      const float w = sample.weight / ((1.0F + off) * (1.0F + off));
      sum += w * sample.bgr;
      total += w;
    }
    best = sum / total;
  }
  return {best, weight};
}

PointColour blend_looks(std::span<const PhotoView> views, std::span<const PhotoLook> looks,
                        const BlendOptions& options) {
  thread_local std::vector<PaintSample> samples;
  samples.clear();
  for (const PhotoLook& look : looks) {
    samples.push_back(paint_in(views[look.photo], look.pixel, look.weight, look.light, options));
  }
  return majority(samples, options);
}

PointColour blend_photos(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal, const BlendOptions& options) {
  thread_local std::vector<PhotoLook> looks;
  look_from_all(views, light, point, normal, looks);
  return blend_looks(views, looks, options);
}

RigLight light_from_photos(std::span<const PhotoView> views, const Mesh& mesh,
                           const std::vector<Eigen::Vector3f>& normals, const BlendOptions& options) {
  const std::size_t step = mesh.vertices.size() / options.light_spots + 1;
  const std::size_t places = (mesh.vertices.size() + step - 1) / step;
  std::vector<int> layers;  // what photos of different layers show at a place need not be one spot
  for (const PhotoView& view : views) layers.push_back(view.photo().layer);
  std::ranges::sort(layers);
  layers.erase(std::unique(layers.begin(), layers.end()), layers.end());
  std::vector<std::vector<LightSample>> spots(places * layers.size());
  for_each_in_blocks(spots.size(), [&](std::size_t i) {
    const std::size_t v = (i % places) * step;
    const Eigen::Vector3d point = mesh.vertices[v].cast<double>();
    const Eigen::Vector3d normal = normals[v].cast<double>();
    for (const PhotoView& view : views) {
      if (view.photo().layer != layers[i / places]) continue;
      const auto sight = view.look(point, normal);
      if (!sight) continue;
      const Sample sample = view.sample(sight->pixel.cast<float>());
      if (sample.saturated || sample.bgr.minCoeff() <= options.outlier_floor) continue;
      const Transform& turntable_from_model = view.photo().turntable_from_model;
      spots[i].push_back(
          {turntable_from_model.linear() * normal, turntable_from_model * point, sample.bgr, sight->weight});
    }
  });
  return fit_rig_light(spots);
}

void fill_unseen(const Mesh& mesh, int rounds, std::vector<PointColour>& colours) {
  const VertexNeighbours neighbours(mesh);
  std::vector<std::uint32_t> known;
  std::vector<std::uint8_t> has(colours.size(), 0);
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (std::uint32_t v = 0; v < colours.size(); ++v) {
    if (colours[v].weight <= 0.0F) continue;
    has[v] = 1;
    known.push_back(v);
    mean += colours[v].bgr;
  }
  if (!known.empty()) mean /= static_cast<float>(known.size());

  // A wave outwards from the known vertices gives every vertex a start and an order ...
  std::vector<std::uint32_t> filled;
  for (std::size_t i = 0; i < known.size() + filled.size(); ++i) {
    const std::uint32_t v = i < known.size() ? known[i] : filled[i - known.size()];
    for (const auto other : neighbours.of(v)) {
      if (has[other] != 0) continue;
      has[other] = 1;
      colours[other].bgr = colours[v].bgr;
      filled.push_back(other);
    }
  }
  for (std::size_t v = 0; v < colours.size(); ++v) {
    if (has[v] == 0) colours[v].bgr = mean;  // a part that no photo sees at all
  }
  // ... and averaging in that order smooths it (Gauss-Seidel on the surface's Laplace equation).
  for (int round = 0; round < rounds; ++round) {
    for (const auto v : filled) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (const auto other : neighbours.of(v)) sum += colours[other].bgr;
      colours[v].bgr = sum / static_cast<float>(neighbours.of(v).size());
    }
  }
}

}  // namespace scanrig
