#include "pipeline/texture/photo_check.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/parallel_blocks.h"
#include "core/statistics.h"
#include "pipeline/texture/point_colour.h"

namespace scanrig {
namespace {

/// One spot in one photo.
struct Difference {
  cv::Point cell;
  float off;         ///< from the blend, against what the blending tolerates; negative: darker
  float brightness;  ///< against the blend
};

/// A photo as a grid of cells.
struct Cells {
  cv::Mat1f off;  ///< median difference; NaN where too few spots lie
  cv::Mat1f brightness;
};

int cell_px(const Photo& photo, const PhotoCheckOptions& options) {
  return std::max(1, photo.camera.projection.width / options.cells);
}

std::vector<Difference> differences_at(std::span<const PhotoView> views, const RigLight& light,
                                       const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                       const BlendOptions& blending, const PhotoCheckOptions& options) {
  std::vector<PhotoLook> looks;
  look_from_all(views, light, point, normal, looks);
  if (looks.size() < options.min_looks) return {};
  const PointColour blend = blend_looks(views, looks, blending);
  if (!(blend.weight > 0.0F)) return {};
  std::vector<Difference> result(views.size(), {{-1, -1}, 0.0F, 1.0F});
  for (const PhotoLook& look : looks) {
    const PhotoView& view = views[look.photo];
    const Eigen::Vector3f difference = view.sample(look.pixel).bgr.cwiseQuotient(look.light) - blend.bgr;
    const float tolerated = blending.outlier_floor + blending.outlier_share * blend.bgr.maxCoeff();
    const int side = cell_px(view.photo(), options);
    const float sum = difference.sum();
    result[look.photo] = {cv::Point(static_cast<int>(look.pixel.x()) / side, static_cast<int>(look.pixel.y()) / side),
                          std::copysign(difference.norm() / tolerated, sum),
                          1.0F + sum / std::max(blend.bgr.sum(), 1e-4F)};
  }
  return result;
}

std::vector<std::vector<Difference>> differences(std::span<const PhotoView> views, const RigLight& light,
                                                 const Mesh& mesh, const std::vector<Eigen::Vector3f>& normals,
                                                 const BlendOptions& blending, const PhotoCheckOptions& options) {
  const std::size_t step = mesh.vertices.size() / options.spots + 1;
  std::vector<std::vector<Difference>> at((mesh.vertices.size() + step - 1) / step);
  for_each_in_blocks(at.size(), [&](std::size_t i) {
    const std::size_t v = i * step;
    at[i] = differences_at(views, light, mesh.vertices[v].cast<double>(), normals[v].cast<double>(), blending, options);
  });
  return at;
}

float median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Cells cells_of(std::size_t p, const Photo& photo, const std::vector<std::vector<Difference>>& spots,
               const PhotoCheckOptions& options) {
  const int side = cell_px(photo, options);
  const Projection& sensor = photo.camera.projection;
  const cv::Size size(sensor.width / side + 1, sensor.height / side + 1);
  std::vector<std::vector<float>> off(static_cast<std::size_t>(size.area())), brightness(off.size());
  for (const auto& spot : spots) {
    if (spot.empty() || spot[p].cell.x < 0) continue;
    const auto i = static_cast<std::size_t>(spot[p].cell.y) * static_cast<std::size_t>(size.width) +
                   static_cast<std::size_t>(spot[p].cell.x);
    off[i].push_back(spot[p].off);
    brightness[i].push_back(spot[p].brightness);
  }
  Cells cells{cv::Mat1f(size, std::nanf("")), cv::Mat1f(size, 1.0F)};
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (off[i].size() < options.min_cell_looks) continue;
    const cv::Point at(static_cast<int>(i) % size.width, static_cast<int>(i) / size.width);
    cells.off(at) = median_of(off[i]);
    cells.brightness(at) = median_of(brightness[i]);
  }
  return cells;
}

/// The difference that makes a cell one of a contradicted photo: from the middle photo, which a single one that is off
/// all over leaves as it is.
float limit_of(const std::vector<Cells>& photos, const PhotoCheckOptions& options) {
  std::vector<double> rare;
  for (const Cells& cells : photos) {
    std::vector<double> sizes;
    for (const float off : cells.off) {
      if (!std::isnan(off)) sizes.push_back(std::abs(static_cast<double>(off)));
    }
    if (!sizes.empty()) rare.push_back(quantile(std::move(sizes), 1.0 - options.rare_share));
  }
  if (rare.empty()) return options.min_off;
  return std::max(options.min_off, options.rare_factor * static_cast<float>(quantile(std::move(rare), 0.5)));
}

/// The cells of connected parts that are off and large; empty: none.
cv::Mat1b odd_cells(const Cells& cells, float limit, const PhotoCheckOptions& options) {
  const cv::Mat1b known(cells.off == cells.off);
  const cv::Mat1f size(cv::abs(cells.off));
  const cv::Mat1b near((size > options.grown_off * limit) & known);
  cv::Mat1i labels;
  cv::Mat stats, centroids;
  const int parts = cv::connectedComponentsWithStats(near, labels, stats, centroids, 8, CV_32S);
  const double least = options.min_share * cv::countNonZero(known);
  cv::Mat1b result(known.size(), uchar{0});
  for (int part = 1; part < parts; ++part) {
    const cv::Mat1b here(labels == part);
    if (cv::countNonZero(here & (size > limit)) >= std::max(2.0, least)) result |= here;
  }
  return cv::countNonZero(result) > 0 ? result : cv::Mat1b();
}

/// A photo that differs from the blend.
struct OddPhoto {
  ContradictedPhoto photo;
  cv::Mat1b cells;
  double amount = 0.0;  ///< differences of those cells together
};

std::optional<OddPhoto> judge(std::size_t p, const Cells& cells, float limit, const PhotoCheckOptions& options) {
  OddPhoto odd{.photo = {.photo = p}, .cells = odd_cells(cells, limit, options)};
  if (odd.cells.empty()) return std::nullopt;
  std::vector<float> brightness;
  for (int y = 0; y < odd.cells.rows; ++y) {
    for (int x = 0; x < odd.cells.cols; ++x) {
      if (odd.cells(y, x) == 0) continue;
      brightness.push_back(cells.brightness(y, x));
      odd.amount += static_cast<double>(std::abs(cells.off(y, x)));
    }
  }
  odd.photo.brightness = static_cast<double>(median_of(brightness));
  odd.photo.share = cv::countNonZero(odd.cells) / static_cast<double>(cv::countNonZero(cells.off == cells.off));
  odd.photo.is_whole = odd.photo.share > options.max_share;
  return odd;
}

void leave_out(PhotoView& view, const OddPhoto& odd, const PhotoCheckOptions& options) {
  cv::Mat1b cells;
  cv::dilate(odd.cells, cells, cv::Mat1b::ones(3, 3));  // its soft edge
  if (odd.photo.is_whole) cells.setTo(255);
  cv::Mat1b pixels;
  cv::resize(cells, pixels, cells.size() * cell_px(view.photo(), options), 0, 0, cv::INTER_NEAREST);
  const Projection& sensor = view.photo().camera.projection;
  view.leave_out(pixels(cv::Rect(0, 0, sensor.width, sensor.height)));
}

std::vector<OddPhoto> odd_photos(std::span<PhotoView> views, const RigLight& light, const Mesh& mesh,
                                 const std::vector<Eigen::Vector3f>& normals, const BlendOptions& blending,
                                 const PhotoCheckOptions& options) {
  const auto spots = differences(views, light, mesh, normals, blending, options);
  std::vector<Cells> cells(views.size());
  parallel_for(views.size(), [&](std::size_t p) { cells[p] = cells_of(p, views[p].photo(), spots, options); });
  const float limit = limit_of(cells, options);
  std::vector<OddPhoto> result;
  for (std::size_t p = 0; p < views.size(); ++p) {
    if (auto odd = judge(p, cells[p], limit, options)) result.push_back(std::move(*odd));
  }
  return result;
}

}  // namespace

std::vector<ContradictedPhoto> leave_out_contradicted(std::span<PhotoView> views, const RigLight& light,
                                                      const Mesh& mesh, const std::vector<Eigen::Vector3f>& normals,
                                                      const BlendOptions& blending, const PhotoCheckOptions& options) {
  std::vector<ContradictedPhoto> result;
  for (std::size_t round = 0; round < views.size(); ++round) {
    auto odd = odd_photos(views, light, mesh, normals, blending, options);
    // A photo that is off all over shifts the blend, and the photos around it seem off too: it goes first, by itself.
    const auto worst =
        std::ranges::max_element(odd, {}, [](const OddPhoto& one) { return one.photo.is_whole ? one.amount : 0.0; });
    const bool is_whole = worst != odd.end() && worst->photo.is_whole;
    if (is_whole) odd = {std::move(*worst)};
    for (const OddPhoto& one : odd) {
      leave_out(views[one.photo.photo], one, options);
      result.push_back(one.photo);
    }
    if (!is_whole) break;
  }
  std::ranges::sort(result, {}, &ContradictedPhoto::photo);
  return result;
}

}  // namespace scanrig
