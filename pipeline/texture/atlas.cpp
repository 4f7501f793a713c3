#include "pipeline/texture/atlas.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "pipeline/texture/filled_image.h"

namespace scanrig {
namespace {

constexpr double kScaleStep = 0.95;
constexpr double kMinScale = 0.01;

/// Shelves: the tallest first, side by side until the row is full. Places in the order of `sizes`, or nothing.
std::optional<std::vector<cv::Point>> pack(const std::vector<cv::Size>& sizes, int side) {
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return sizes[a].height > sizes[b].height; });
  std::vector<cv::Point> places(sizes.size());
  cv::Point next(0, 0);
  int shelf = 0;
  for (const std::size_t i : order) {
    if (sizes[i].width > side) return std::nullopt;
    if (next.x + sizes[i].width > side) {
      next = {0, next.y + shelf};
      shelf = 0;
    }
    shelf = std::max(shelf, sizes[i].height);
    if (next.y + shelf > side) return std::nullopt;
    places[i] = next;
    next.x += sizes[i].width;
  }
  return places;
}

/// The texel centres in the box around a face.
cv::Rect box_around(const std::array<Eigen::Vector2d, 3>& corners) {
  const Eigen::Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
  const Eigen::Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  const cv::Point first(static_cast<int>(std::ceil(low.x())), static_cast<int>(std::ceil(low.y())));
  const cv::Point last(static_cast<int>(std::floor(high.x())), static_cast<int>(std::floor(high.y())));
  return {first, last + cv::Point(1, 1)};
}

void draw_face(const std::array<Eigen::Vector2d, 3>& corners, double depth, int face, const std::vector<double>& depths,
               cv::Mat1i& owner) {
  const cv::Rect box = box_around(corners);
  for (int y = box.y; y < box.br().y; ++y) {
    for (int x = box.x; x < box.br().x; ++x) {
      int& now = owner(y, x);
      if (now >= 0 && !(depth < depths[static_cast<std::size_t>(now)])) continue;
      const auto weights = barycentric(corners, {x, y});
      if (weights && weights->minCoeff() >= 0.0) now = face;
    }
  }
}

/// Gives the faces at the rim of a chart the texels next to it, round after round.
void pad(cv::Mat1i chart, int padding, std::vector<std::uint8_t>& is_padded) {
  struct Padding {
    cv::Point texel;
    int face;
  };
  const auto around = [&](cv::Point at) {
    return cv::Rect(at - cv::Point(1, 1), cv::Size(3, 3)) & cv::Rect({0, 0}, chart.size());
  };
  const auto first_neighbour = [&](cv::Point at) {
    const cv::Rect box = around(at);
    for (int y = box.y; y < box.br().y; ++y) {
      for (int x = box.x; x < box.br().x; ++x) {
        if (chart(y, x) >= 0) return chart(y, x);
      }
    }
    return -1;
  };
  std::vector<Padding> rim, next;
  for (int y = 0; y < chart.rows; ++y) {
    for (int x = 0; x < chart.cols; ++x) {
      const int face = chart(y, x) < 0 ? first_neighbour({x, y}) : -1;
      if (face >= 0) rim.push_back({{x, y}, face});
    }
  }
  for (int round = 0; round < padding; ++round) {
    for (const Padding& one : rim) {
      chart(one.texel) = one.face;
      is_padded[static_cast<std::size_t>(one.face)] = 1;
    }
    next.clear();
    for (const Padding& one : rim) {
      const cv::Rect box = around(one.texel);
      for (int y = box.y; y < box.br().y; ++y) {
        for (int x = box.x; x < box.br().x; ++x) {
          if (chart(y, x) < 0) next.push_back({{x, y}, first_neighbour({x, y})});
        }
      }
    }
    std::swap(rim, next);
  }
}

}  // namespace

std::optional<Eigen::Vector3d> barycentric(const std::array<Eigen::Vector2d, 3>& corners, const Eigen::Vector2d& at) {
  const Eigen::Vector2d a = corners[1] - corners[0];
  const Eigen::Vector2d b = corners[2] - corners[0];
  const Eigen::Vector2d p = at - corners[0];
  const double area = a.x() * b.y() - a.y() * b.x();
  if (std::abs(area) < 1e-12) return std::nullopt;
  const double first = (p.x() * b.y() - p.y() * b.x()) / area;
  const double second = (a.x() * p.y() - a.y() * p.x()) / area;
  return Eigen::Vector3d(1.0 - first - second, first, second);
}

cv::Rect AtlasLayout::box_of(std::size_t face) const {
  const int beyond = is_padded[face] != 0 ? padding_px : 0;
  const cv::Rect box = box_around(corners[face]);
  return (box - cv::Point(beyond, beyond) + cv::Size(2 * beyond, 2 * beyond)) & cv::Rect({0, 0}, owner.size());
}

std::optional<AtlasLayout> lay_out(const Mesh& mesh, std::span<const ChartView> views, std::span<const Chart> charts,
                                   int atlas_px, double max_texels_per_px, int padding_px) {
  AtlasLayout layout;
  layout.corners.resize(mesh.faces.size());
  std::vector<double> depths(mesh.faces.size());
  std::vector<Eigen::AlignedBox2d> boxes(charts.size());
  parallel_for(charts.size(), [&](std::size_t c) {
    const ChartView& view = views[charts[c].view];
    for (const auto f : charts[c].faces) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3f& vertex = mesh.vertices[mesh.faces[f][k]];
        layout.corners[f][k] = view.project(vertex);
        depths[f] += (view.view_from_model * vertex.cast<double>()).z() / 3.0;
        boxes[c].extend(layout.corners[f][k]);
      }
    }
  });

  std::optional<std::vector<cv::Point>> places;
  std::vector<cv::Size> sizes(charts.size());
  for (double scale = max_texels_per_px; scale > kMinScale && !places; scale *= kScaleStep) {
    for (std::size_t c = 0; c < charts.size(); ++c) {
      // In double first: an imported mesh may be any size.
      const Eigen::Vector2d size = (scale * boxes[c].sizes()).cwiseMin(1e6);
      sizes[c] = cv::Size(static_cast<int>(std::ceil(size.x())), static_cast<int>(std::ceil(size.y()))) +
                 cv::Size(2 * padding_px + 1, 2 * padding_px + 1);
    }
    places = pack(sizes, atlas_px);
    layout.texels_per_px = scale;
  }
  if (!places) return std::nullopt;

  int rows = 0;
  for (std::size_t c = 0; c < charts.size(); ++c) rows = std::max(rows, (*places)[c].y + sizes[c].height);
  layout.owner = filled_image<int>({atlas_px, rows}, -1);
  layout.padding_px = padding_px;
  layout.is_padded.assign(mesh.faces.size(), 0);
  parallel_for(charts.size(), [&](std::size_t c) {
    const Eigen::Vector2d origin((*places)[c].x + padding_px, (*places)[c].y + padding_px);
    for (const auto f : charts[c].faces) {
      for (auto& corner : layout.corners[f]) corner = layout.texels_per_px * (corner - boxes[c].min()) + origin;
      draw_face(layout.corners[f], depths[f], static_cast<int>(f), depths, layout.owner);
    }
    pad(layout.owner(cv::Rect((*places)[c], sizes[c])), padding_px, layout.is_padded);
  });
  return layout;
}

}  // namespace scanrig
