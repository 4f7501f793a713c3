#include "pipeline/texture/chart_cutting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "core/parallel_blocks.h"

namespace scanrig {
namespace {

using Label = std::uint16_t;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

using FaceNeighbours = std::vector<std::array<std::uint32_t, 3>>;

/// The face across each edge (corner k to k + 1), or kNone. Of more than two faces at an edge, the first two in their
/// order are neighbours, then the next two.
FaceNeighbours neighbours_of_faces(const Mesh& mesh) {
  const auto corner = [&](std::uint32_t edge) { return mesh.faces[edge / 3][edge % 3]; };
  const auto end = [&](std::uint32_t edge) { return mesh.faces[edge / 3][(edge % 3 + 1) % 3]; };
  // Edges, three of each face, by their lower vertex.
  const auto count = static_cast<std::uint32_t>(3 * mesh.faces.size());
  std::vector<std::uint32_t> first(mesh.vertices.size() + 2, 0), edges(count);
  for (std::uint32_t e = 0; e < count; ++e) ++first[std::min(corner(e), end(e)) + 2];
  for (std::size_t v = 2; v < first.size(); ++v) first[v] += first[v - 1];
  for (std::uint32_t e = 0; e < count; ++e) edges[first[std::min(corner(e), end(e)) + 1]++] = e;

  FaceNeighbours found(mesh.faces.size(), {kNone, kNone, kNone});
  for_each_in_blocks(mesh.vertices.size(), [&](std::size_t v) {
    const std::span<std::uint32_t> here(edges.data() + first[v], edges.data() + first[v + 1]);
    const auto far_end = [&](std::uint32_t edge) { return std::max(corner(edge), end(edge)); };
    std::ranges::sort(here, {}, [&](std::uint32_t edge) { return std::pair(far_end(edge), edge); });
    for (std::size_t i = 0; i + 1 < here.size(); ++i) {
      if (far_end(here[i]) != far_end(here[i + 1])) continue;
      found[here[i] / 3][here[i] % 3] = here[i + 1] / 3;
      found[here[i + 1] / 3][here[i + 1] % 3] = here[i] / 3;
      ++i;
    }
  });
  return found;
}

/// Quality of each view for flattening each face: 255 * cosine, 0 = cannot.
class Quality {
 public:
  Quality(const Mesh& mesh, std::span<const ChartView> views, std::size_t photos, const VertexLooks& looks,
          const ChartOptions& options)
      : views_(views.size()), photos_(photos), of_(mesh.faces.size() * views.size(), 0), faces_(mesh.faces.size()) {
    for_each_in_blocks(faces_.size(), [&](std::size_t f) { judge(mesh, views, looks, options, f); });
  }
  [[nodiscard]] int operator()(std::size_t face, std::size_t view) const { return of_[face * views_ + view]; }
  [[nodiscard]] int best(std::size_t face) const { return of_[face * views_ + faces_[face].best_view]; }
  [[nodiscard]] Label best_view(std::size_t face) const { return faces_[face].best_view; }
  /// Sufficient to flatten the face.
  [[nodiscard]] bool is_good(std::size_t face, std::size_t view) const {
    return of_[face * views_ + view] >= faces_[face].good;
  }
  [[nodiscard]] double area(std::size_t face) const { return faces_[face].area; }
  [[nodiscard]] std::size_t faces() const { return faces_.size(); }
  [[nodiscard]] std::size_t photos() const { return photos_; }

 private:
  struct OfFace {
    double area = 0.0;
    Label best_view = 0;
    std::uint8_t good = 1;
  };

  void judge(const Mesh& mesh, std::span<const ChartView> views, const VertexLooks& looks, const ChartOptions& options,
             std::size_t f) {
    const auto& [a, b, c] = mesh.faces[f];
    const Eigen::Vector3d corner = mesh.vertices[a].cast<double>();
    const Eigen::Vector3d across =
        (mesh.vertices[b].cast<double>() - corner).cross(mesh.vertices[c].cast<double>() - corner);
    const Eigen::Vector3d normal = across.normalized();
    const std::span<std::uint8_t> row(of_.data() + f * views_, views_);
    const auto grade = [&](std::size_t v) {
      return static_cast<std::uint8_t>(std::clamp(255.0 * views[v].cosine(corner, normal), 0.0, 255.0));
    };
    bool any = false;
    for_photos_of_face({looks.of(a), looks.of(b), looks.of(c)}, [&](std::size_t p, const auto& corners) {
      const bool is_whole = std::ranges::none_of(corners, [](const PhotoLook* look) { return look == nullptr; });
      const std::uint8_t cosine = is_whole ? grade(p) : std::uint8_t{0};
      row[p] = cosine >= 255 * options.min_facing ? cosine : std::uint8_t{0};
      any |= row[p] != 0;
      return true;
    });
    for (std::size_t v = photos_; v < views_ && !any; ++v) row[v] = grade(v);
    const auto best = std::ranges::max_element(row);
    faces_[f] = {0.5 * across.norm(), static_cast<Label>(best - row.begin()),
                 static_cast<std::uint8_t>(std::max(1, static_cast<int>(options.good_share * *best)))};
  }

  std::size_t views_, photos_;
  std::vector<std::uint8_t> of_;
  std::vector<OfFace> faces_;
};

/// The area of the faces of `open` that each photo shows well enough.
std::vector<double> gains(const Quality& quality, const std::vector<std::uint32_t>& open) {
  constexpr std::size_t kGroup = 8;  // photos per task: their qualities lie side by side
  std::vector<double> gain(quality.photos(), 0.0);
  parallel_for((gain.size() + kGroup - 1) / kGroup, [&](std::size_t group) {
    const std::size_t begin = group * kGroup, end = std::min(begin + kGroup, gain.size());
    std::array<double, kGroup> sums{};
    for (const std::uint32_t f : open) {
      for (std::size_t p = begin; p < end; ++p) sums[p - begin] += quality.is_good(f, p) ? quality.area(f) : 0.0;
    }
    std::copy_n(sums.begin(), end - begin, gain.begin() + static_cast<std::ptrdiff_t>(begin));
  });
  return gain;
}

/// Greedy set cover: picks the photo that shows most of the rest well enough next.
std::vector<Label> cover(const Quality& quality, const ChartOptions& options) {
  std::vector<Label> labels(quality.faces());
  double seen_area = 0.0;
  for (std::size_t f = 0; f < labels.size(); ++f) {
    labels[f] = quality.best_view(f);
    if (labels[f] < quality.photos() && quality.best(f) > 0) seen_area += quality.area(f);
  }
  std::vector<std::uint32_t> open(labels.size());
  std::iota(open.begin(), open.end(), 0U);
  for (;;) {
    const std::vector<double> gain = gains(quality, open);
    const auto next = static_cast<std::size_t>(std::max_element(gain.begin(), gain.end()) - gain.begin());
    if (gain[next] <= options.min_gain * seen_area) break;
    for (const std::uint32_t f : open) {
      if (quality.is_good(f, next)) labels[f] = static_cast<Label>(next);
    }
    std::erase_if(open, [&](std::uint32_t f) { return quality.is_good(f, next); });
  }
  return labels;
}

/// Iterated conditional modes on cost = cosine lost + borders, face by face in order.
void smooth(const Quality& quality, const FaceNeighbours& neighbours, const ChartOptions& options,
            std::vector<Label>& labels) {
  bool is_changed = true;
  for (int round = 0; round < options.smoothing_rounds && is_changed; ++round) {
    is_changed = false;
    for (std::size_t f = 0; f < labels.size(); ++f) {
      const auto is_other = [&](std::uint32_t other) { return other != kNone && labels[other] != labels[f]; };
      if (std::ranges::none_of(neighbours[f], is_other)) continue;
      const double best = std::max(1, quality.best(f));
      const auto cost = [&](Label label) {
        double borders = 0.0;
        for (const auto other : neighbours[f])
          borders += other != kNone && labels[other] != label ? options.border_cost : 0.0;
        return 1.0 - quality(f, label) / best + borders;
      };
      Label chosen = labels[f];
      for (const auto other : neighbours[f]) {
        if (other == kNone || quality(f, labels[other]) == 0) continue;
        if (cost(labels[other]) < cost(chosen)) chosen = labels[other];
      }
      is_changed |= chosen != labels[f];
      labels[f] = chosen;
    }
  }
}

std::vector<Chart> connected(const FaceNeighbours& neighbours, const std::vector<Label>& labels) {
  std::vector<Chart> charts;
  std::vector<std::uint32_t> chart_of(labels.size(), kNone), reached;
  for (std::uint32_t start = 0; start < labels.size(); ++start) {
    if (chart_of[start] != kNone) continue;
    const auto chart = static_cast<std::uint32_t>(charts.size());
    chart_of[start] = chart;
    reached = {start};
    for (std::size_t i = 0; i < reached.size(); ++i) {
      for (const auto other : neighbours[reached[i]]) {
        if (other == kNone || chart_of[other] != kNone || labels[other] != labels[start]) continue;
        chart_of[other] = chart;
        reached.push_back(other);
      }
    }
    charts.push_back({labels[start], {}});
    charts.back().faces.reserve(reached.size());
  }
  for (std::uint32_t f = 0; f < labels.size(); ++f) charts[chart_of[f]].faces.push_back(f);
  return charts;
}

/// Gives each small chart as a whole to the neighbouring label with the longest common border that can take it. False:
/// none was given.
bool join_small(const Mesh& mesh, std::span<const ChartView> views, const Quality& quality,
                const FaceNeighbours& neighbours, const ChartOptions& options, const std::vector<Chart>& charts,
                std::vector<Label>& labels) {
  bool is_changed = false;
  for (const Chart& chart : charts) {
    if (chart.faces.size() >= options.small_chart) continue;
    std::vector<std::uint32_t> border(views.size(), 0);
    for (const auto f : chart.faces) {
      for (const auto other : neighbours[f]) {
        if (other != kNone && labels[other] != chart.view) ++border[labels[other]];
      }
    }
    const auto can_take = [&](std::size_t view) {
      return std::all_of(chart.faces.begin(), chart.faces.end(), [&](std::uint32_t f) {
        if (quality(f, view) > 0) return true;
        if (chart.faces.size() >= options.tiny_chart) return false;
        const Eigen::Vector3d a = mesh.vertices[mesh.faces[f][0]].cast<double>();
        const Eigen::Vector3d b = mesh.vertices[mesh.faces[f][1]].cast<double>();
        const Eigen::Vector3d c = mesh.vertices[mesh.faces[f][2]].cast<double>();
        return views[view].cosine(a, (b - a).cross(c - a).normalized()) > options.min_facing;
      });
    };
    std::size_t chosen = chart.view;
    std::uint32_t longest = 0;
    for (std::size_t view = 0; view < views.size(); ++view) {
      if (border[view] > longest && can_take(view)) {
        chosen = view;
        longest = border[view];
      }
    }
    for (const auto f : chart.faces) labels[f] = static_cast<Label>(chosen);
    is_changed |= chosen != chart.view;
  }
  return is_changed;
}

}  // namespace

double ChartView::cosine(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
  const Eigen::Vector3d n = view_from_model.linear() * normal;
  if (projection.kind == Projection::Kind::orthographic) return -n.z();
  return -n.dot((view_from_model * point).normalized());
}

std::vector<ChartView> chart_views(std::span<const PhotoView> photos, double px_per_mm) {
  std::vector<ChartView> views;
  for (const PhotoView& photo : photos) views.push_back({photo.photo().camera.projection, photo.camera_from_model()});
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      ChartView view;
      view.projection.kind = Projection::Kind::orthographic;
      view.projection.fx = view.projection.fy = px_per_mm;
      const Eigen::Vector3d z = -side * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d x = Eigen::Vector3d::Unit((axis + 1) % 3);
      view.view_from_model.linear() << x.transpose(), z.cross(x).transpose(), z.transpose();
      views.push_back(view);
    }
  }
  return views;
}

std::vector<Chart> cut_into_charts(const Mesh& mesh, std::span<const ChartView> views, std::size_t photos,
                                   const VertexLooks& looks, const ChartOptions& options) {
  const Quality quality(mesh, views, photos, looks, options);
  const FaceNeighbours neighbours = neighbours_of_faces(mesh);
  std::vector<Label> labels = cover(quality, options);
  smooth(quality, neighbours, options, labels);
  std::vector<Chart> charts = connected(neighbours, labels);
  for (int round = 0; round < options.join_rounds; ++round) {
    if (!join_small(mesh, views, quality, neighbours, options, charts, labels)) break;
    charts = connected(neighbours, labels);
  }
  return charts;
}

}  // namespace scanrig
