#include "pipeline/texture/chart_cutting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

#include "core/parallel.h"

namespace scanrig {
namespace {

using Label = std::uint16_t;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

using FaceNeighbours = std::vector<std::array<std::uint32_t, 3>>;

/// The face across each edge (corner k to k + 1), or kNone.
FaceNeighbours neighbours_of_faces(const Mesh& mesh) {
  struct Edge {
    std::uint64_t ends;
    std::uint32_t face, side;
  };
  std::vector<Edge> edges;
  edges.reserve(mesh.faces.size() * 3);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]});
      edges.push_back({std::uint64_t{low} << 32U | high, f, k});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.ends != b.ends ? a.ends < b.ends : a.face < b.face; });
  FaceNeighbours found(mesh.faces.size(), {kNone, kNone, kNone});
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i].ends != edges[i + 1].ends) continue;
    found[edges[i].face][edges[i].side] = edges[i + 1].face;
    found[edges[i + 1].face][edges[i + 1].side] = edges[i].face;
    ++i;
  }
  return found;
}

/// Quality of each view for flattening each face: 255 * cosine, 0 = cannot.
class Quality {
 public:
  Quality(const Mesh& mesh, std::span<const ChartView> views, std::size_t photos, const std::vector<std::uint8_t>& seen,
          double min_facing)
      : views_(views.size()),
        photos_(photos),
        min_facing_(min_facing),
        area_(mesh.faces.size()),
        of_(mesh.faces.size() * views.size(), 0) {
    constexpr std::size_t block = 4096;
    parallel_for((mesh.faces.size() + block - 1) / block, [&](std::size_t b) {
      for (std::size_t f = b * block; f < std::min(mesh.faces.size(), (b + 1) * block); ++f)
        judge(mesh, views, seen, f);
    });
  }
  [[nodiscard]] int operator()(std::size_t face, std::size_t view) const { return of_[face * views_ + view]; }
  [[nodiscard]] int best(std::size_t face) const { return *std::max_element(row(face), row(face) + views_); }
  [[nodiscard]] Label best_view(std::size_t face) const {
    return static_cast<Label>(std::max_element(row(face), row(face) + views_) - row(face));
  }
  [[nodiscard]] double area(std::size_t face) const { return area_[face]; }
  [[nodiscard]] std::size_t faces() const { return area_.size(); }
  [[nodiscard]] std::size_t photos() const { return photos_; }

 private:
  [[nodiscard]] const std::uint8_t* row(std::size_t face) const { return of_.data() + face * views_; }

  void judge(const Mesh& mesh, std::span<const ChartView> views, const std::vector<std::uint8_t>& seen, std::size_t f) {
    const auto& [a, b, c] = mesh.faces[f];
    const Eigen::Vector3d corner = mesh.vertices[a].cast<double>();
    const Eigen::Vector3d across =
        (mesh.vertices[b].cast<double>() - corner).cross(mesh.vertices[c].cast<double>() - corner);
    area_[f] = 0.5 * across.norm();
    const Eigen::Vector3d normal = across.normalized();
    const auto grade = [&](std::size_t v) {
      return static_cast<std::uint8_t>(std::clamp(255.0 * views[v].cosine(corner, normal), 0.0, 255.0));
    };
    bool any = false;
    for (std::size_t p = 0; p < photos_; ++p) {
      if ((seen[a * photos_ + p] & seen[b * photos_ + p] & seen[c * photos_ + p]) == 0) continue;
      const auto cosine = grade(p);
      of_[f * views_ + p] = cosine >= 255 * min_facing_ ? cosine : std::uint8_t{0};
      any |= of_[f * views_ + p] != 0;
    }
    for (std::size_t v = photos_; v < views_ && !any; ++v) of_[f * views_ + v] = grade(v);
  }

  std::size_t views_, photos_;
  double min_facing_;
  std::vector<double> area_;
  std::vector<std::uint8_t> of_;
};

/// Greedy set cover: picks the photo that shows most of the rest well enough next.
std::vector<Label> cover(const Quality& quality, const ChartOptions& options) {
  constexpr Label open = std::numeric_limits<Label>::max();
  std::vector<Label> labels(quality.faces(), open);
  std::vector<int> enough(quality.faces());
  double seen_area = 0.0;
  for (std::size_t f = 0; f < labels.size(); ++f) {
    enough[f] = std::max(1, static_cast<int>(options.good_share * quality.best(f)));
    if (quality.best_view(f) < quality.photos() && quality.best(f) > 0) seen_area += quality.area(f);
  }
  for (;;) {
    std::vector<double> gain(quality.photos(), 0.0);
    parallel_for(gain.size(), [&](std::size_t p) {
      for (std::size_t f = 0; f < labels.size(); ++f) {
        if (labels[f] == open && quality(f, p) >= enough[f]) gain[p] += quality.area(f);
      }
    });
    const auto next = static_cast<std::size_t>(std::max_element(gain.begin(), gain.end()) - gain.begin());
    if (gain[next] <= options.min_gain * seen_area) break;
    for (std::size_t f = 0; f < labels.size(); ++f) {
      if (labels[f] == open && quality(f, next) >= enough[f]) labels[f] = static_cast<Label>(next);
    }
  }
  for (std::size_t f = 0; f < labels.size(); ++f) {
    if (labels[f] == open) labels[f] = quality.best_view(f);
  }
  return labels;
}

/// Iterated conditional modes on cost = cosine lost + borders, face by face in order.
void smooth(const Quality& quality, const FaceNeighbours& neighbours, const ChartOptions& options,
            std::vector<Label>& labels) {
  for (int round = 0; round < options.smoothing_rounds; ++round) {
    for (std::size_t f = 0; f < labels.size(); ++f) {
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
      labels[f] = chosen;
    }
  }
}

std::vector<Chart> connected(const FaceNeighbours& neighbours, const std::vector<Label>& labels) {
  std::vector<Chart> charts;
  std::vector<std::uint8_t> taken(labels.size(), 0);
  for (std::uint32_t start = 0; start < labels.size(); ++start) {
    if (taken[start] != 0) continue;
    Chart chart{labels[start], {start}};
    taken[start] = 1;
    for (std::size_t i = 0; i < chart.faces.size(); ++i) {
      for (const auto other : neighbours[chart.faces[i]]) {
        if (other == kNone || taken[other] != 0 || labels[other] != chart.view) continue;
        taken[other] = 1;
        chart.faces.push_back(other);
      }
    }
    std::sort(chart.faces.begin(), chart.faces.end());
    charts.push_back(std::move(chart));
  }
  return charts;
}

/// Gives each small chart as a whole to the neighbouring label with the longest common border that can take it.
void join_small(const Mesh& mesh, std::span<const ChartView> views, const Quality& quality,
                const FaceNeighbours& neighbours, const ChartOptions& options, std::vector<Label>& labels) {
  for (const Chart& chart : connected(neighbours, labels)) {
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
  }
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
                                   const std::vector<std::uint8_t>& seen, const ChartOptions& options) {
  const Quality quality(mesh, views, photos, seen, options.min_facing);
  const FaceNeighbours neighbours = neighbours_of_faces(mesh);
  std::vector<Label> labels = cover(quality, options);
  smooth(quality, neighbours, options, labels);
  for (int round = 0; round < options.join_rounds; ++round)
    join_small(mesh, views, quality, neighbours, options, labels);
  return connected(neighbours, labels);
}

}  // namespace scanrig
