#include "pipeline/texture/point_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace scanrig {
namespace {

struct Look {
  Eigen::Vector3f bgr;
  float weight;
};

/// The vertices that share an edge with each vertex, as offsets into one list.
struct Neighbours {
  std::vector<std::uint32_t> first, list;
  explicit Neighbours(const Mesh& mesh) : first(mesh.vertices.size() + 1, 0) {
    for (const auto& face : mesh.faces) {
      for (const auto v : face) first[v + 1] += 2;
    }
    for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
    list.resize(first.back());
    auto next = first;
    for (const auto& face : mesh.faces) {
      for (std::size_t k = 0; k < 3; ++k) {
        list[next[face[k]]++] = face[(k + 1) % 3];
        list[next[face[k]]++] = face[(k + 2) % 3];
      }
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t v) const {
    return {list.data() + first[v], list.data() + first[v + 1]};
  }
};

}  // namespace

PointColour blend_photos(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal, const BlendOptions& options) {
  thread_local std::vector<Look> looks;
  looks.clear();
  for (const PhotoView& view : views) {
    const auto sight = view.look(point, normal);
    if (!sight) continue;
    const Transform& turntable_from_model = view.photo().turntable_from_model;
    const Eigen::Vector3f lit = light.at(turntable_from_model.linear() * normal, turntable_from_model * point);
    const Sample sample = view.sample(sight->pixel);
    const float reliability = sample.saturated ? options.saturated_weight : 1.0F;
    looks.push_back({sample.bgr.cwiseQuotient(lit), reliability * static_cast<float>(sight->weight)});
  }
  if (looks.empty()) return {};

  Eigen::Vector3f best = Eigen::Vector3f::Zero();
  float weight = 0.0F;
  for (const Look& look : looks) {
    best += look.weight * look.bgr;
    weight += look.weight;
  }
  best /= weight;
  // From wide to narrow, so that the majority is found without a jump anywhere on the surface.
  for (const float width : options.outlier_widths) {
    const float limit = width * (options.outlier_floor + options.outlier_share * best.maxCoeff());
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float total = 0.0F;
    for (const Look& look : looks) {
      const float off = (look.bgr - best).squaredNorm() / (limit * limit);
      const float w = look.weight / ((1.0F + off) * (1.0F + off));
      sum += w * look.bgr;
      total += w;
    }
    best = sum / total;
  }
  return {best, weight};
}

RigLight light_from_photos(std::span<const PhotoView> views, const Mesh& mesh,
                           const std::vector<Eigen::Vector3f>& normals, const BlendOptions& options) {
  const std::size_t step = mesh.vertices.size() / options.light_spots + 1;
  std::vector<std::vector<LightSample>> spots;
  for (std::size_t v = 0; v < mesh.vertices.size(); v += step) {
    const Eigen::Vector3d point = mesh.vertices[v].cast<double>();
    const Eigen::Vector3d normal = normals[v].cast<double>();
    std::vector<LightSample> spot;
    for (const PhotoView& view : views) {
      const auto sight = view.look(point, normal);
      if (!sight) continue;
      const Sample sample = view.sample(sight->pixel);
      if (sample.saturated || sample.bgr.minCoeff() <= options.outlier_floor) continue;
      const Transform& turntable_from_model = view.photo().turntable_from_model;
      spot.push_back({turntable_from_model.linear() * normal, turntable_from_model * point, sample.bgr, sight->weight});
    }
    spots.push_back(std::move(spot));
  }
  return fit_rig_light(spots);
}

void fill_unseen(const Mesh& mesh, int rounds, std::vector<PointColour>& colours) {
  const Neighbours neighbours(mesh);
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
