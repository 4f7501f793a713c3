#include "tests/bench/range/rendered_scan.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/evaluate/true_view.h"
#include "pipeline/range/view_builder.h"
#include "pipeline/storage/scan_folder.h"
#include "tests/bench/range/disparity_figures.h"
#include "tests/bench/range/row_field.h"

namespace scanrig::bench {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

void move_rows(RectifyingMap& map, double rows_px) {
  const cv::Mat1f u = map.u.clone(), v = map.v.clone();
  const cv::Size size = u.size();
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      // A point of row y appears in row y + field: at row y the image shows what was at y - field.
      const float at = std::clamp(static_cast<float>(y) - row_field(x, y, size, rows_px), 0.0F,
                                  static_cast<float>(size.height) - 1.001F);
      const int row = static_cast<int>(at);
      const float t = at - static_cast<float>(row);
      map.u(y, x) = (1.0F - t) * u(row, x) + t * u(row + 1, x);
      map.v(y, x) = (1.0F - t) * v(row, x) + t * v(row + 1, x);
    }
  }
}

/// The truth as the rectified cameras see it.
Truth rectified_truth(Truth truth, const Rectification& r) {
  truth.left = Camera{};
  truth.left.projection = r.left;
  truth.left.camera_from_turntable = r.left_from_turntable;
  truth.right = Camera{};
  truth.right.projection = r.right;
  truth.right.camera_from_turntable = r.right_from_turntable;
  return truth;
}

cv::Mat1f disparity_of(const cv::Mat1f& depth, const Rectification& r) {
  cv::Mat1f disparity(depth.size(), kNan);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      if (std::isfinite(depth(v, u))) {
        disparity(v, u) =
            static_cast<float>(r.left.fx * r.baseline_mm / static_cast<double>(depth(v, u)) + r.left.cx - r.right.cx);
      }
    }
  }
  return disparity;
}

}  // namespace

Result<RenderedScan> open_rendered(const std::filesystem::path& folder) {
  auto scan = ScanFolder::open(folder);
  if (!scan) return pass_on(scan);
  const auto calibration = scan->load_calibration();
  if (!calibration) return pass_on(calibration);
  auto rectification = rectify(*calibration);
  if (!rectification) return pass_on(rectification);
  auto truth = read_truth(folder);
  if (!truth) return pass_on(truth);
  Truth seen = rectified_truth(std::move(*truth), *rectification);
  return RenderedScan{std::move(*scan), std::move(*rectification), std::move(seen)};
}

DisparityPair true_disparities(const RenderedScan& scan, const TrueView& view) {
  const Truth& truth = scan.truth;
  DisparityPair pair;
  const TrueImage& left = view.left();
  cv::Mat1f depth = left.depth.clone();
  pair.incidence = cv::Mat1f(depth.size(), 0.0F);
  pair.seen_by_all = cv::Mat1b(depth.size(), std::uint8_t{0});
  const Transform truth_from_left = left.camera.camera_from_turntable.inverse();
  parallel_for(static_cast<std::size_t>(depth.rows), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < depth.cols; ++u) {
      const int face = left.face(v, u);
      if (face < 0) {
        depth(v, u) = kNan;
        continue;
      }
      const Eigen::Vector3d point =
          truth_from_left * left.camera.projection.unproject(u, v, static_cast<double>(depth(v, u)));
      const auto& corners = truth.mesh.faces[static_cast<std::size_t>(face)];
      const auto corner = [&](int i) { return truth.mesh.vertices[corners[i]].cast<double>().eval(); };
      const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
      for (const TrueImage* image : {&left, &view.right()}) {
        const double cosine = std::clamp((image->centre - point).normalized().dot(normal), -1.0, 1.0);
        pair.incidence(v, u) = std::max(pair.incidence(v, u), static_cast<float>(to_degrees(std::acos(cosine))));
      }
      pair.seen_by_all(v, u) = view.observes(point, normal) ? 255 : 0;
    }
  });
  pair.truth = disparity_of(depth, scan.rectification);
  return pair;
}

DisparityPair compare(const RangeImage& range, const RenderedScan& scan, const TrueView& view) {
  const Rectification& r = scan.rectification;
  DisparityPair pair = true_disparities(scan, view);
  pair.measured = disparity_of(range.depth, r);
  pair.sigma = range.sigma.mul(r.left.fx * r.baseline_mm / range.depth.mul(range.depth));
  return pair;
}

ObservableRule every_point() {
  ObservableRule all;
  all.max_incidence_deg = 88.0;
  all.depth_jump_mm = 1e9;
  return all;
}

Result<nlohmann::json> measure_scan(const std::filesystem::path& folder, double rows_px) {
  auto opened = open_rendered(folder);
  if (!opened) return pass_on(opened);
  auto& [scan, rectification, truth] = *opened;
  const auto surface = SurfaceIndex::create(truth.mesh);
  if (!surface) return pass_on(surface);
  if (rows_px != 0.0) move_rows(rectification.right_map, rows_px);
  DisparityFigures figures;
  std::vector<double> errors;
  double seconds = 0.0, views = 0.0, rows = 0.0;
  for (std::size_t pose = 0; pose < truth.poses.size(); ++pose) {
    for (std::size_t v = 0; v < truth.poses[pose].angles_deg.size(); ++v) {
      const auto images = scan.load_images(pose, v);
      if (!images) return pass_on(images);
      const auto start = std::chrono::steady_clock::now();
      const auto view = make_view(
          rectification, {images->left_pattern, images->right_pattern, images->left_plain, images->right_plain},
          images->angle_rad, images->index, {}, {});
      if (!view) return pass_on(view);
      seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      views += 1.0;
      for (const RowOffset& cell : view->range.row_offsets.cells) rows = std::max(rows, std::abs(cell.offset_px));
      const TrueView seen(truth, *surface, truth.poses[pose], truth.poses[pose].angles_deg[v], every_point());
      const DisparityPair pair = compare(view->range, *opened, seen);
      figures.add(pair);
      const cv::Mat1f& depth = view->range.depth;
      for (int y = 0; y < depth.rows; ++y) {
        for (int x = 0; x < depth.cols; ++x) {
          if (std::isnan(depth(y, x)) || seen.left().face(y, x) < 0) continue;
          errors.push_back(std::abs(static_cast<double>(depth(y, x)) - static_cast<double>(seen.left().depth(y, x))));
        }
      }
    }
  }
  std::sort(errors.begin(), errors.end());
  nlohmann::json json = figures.json();
  json["seconds"] = seconds / views;
  json["rows_px"] = rows;
  if (!errors.empty()) {
    json["depth_median_mm"] = errors[errors.size() / 2];
    json["depth_p95_mm"] = errors[errors.size() * 95 / 100];
  }
  return json;
}

Result<MeasuredView> first_view(const std::filesystem::path& folder) {
  auto opened = open_rendered(folder);
  if (!opened) return pass_on(opened);
  auto& [scan, rectification, truth] = *opened;
  const auto surface = SurfaceIndex::create(truth.mesh);
  if (!surface) return pass_on(surface);
  const auto images = scan.load_images(0, 0);
  if (!images) return pass_on(images);
  const auto view =
      make_view(rectification, {images->left_pattern, images->right_pattern, images->left_plain, images->right_plain},
                images->angle_rad, images->index, {}, {});
  if (!view) return pass_on(view);
  const auto photograph = rectified(rectification.left_map, images->left_plain);
  if (!photograph) return pass_on(photograph);
  const TrueView seen(truth, *surface, truth.poses[0], truth.poses[0].angles_deg[0], {});
  MeasuredView out{*photograph, view->range.depth, view->range.sigma, {}};
  cv::subtract(view->range.depth, seen.left().depth, out.error_mm);
  std::vector<float> errors;
  for (int v = 0; v < out.error_mm.rows; ++v) {
    for (int u = 0; u < out.error_mm.cols; ++u) {
      if (seen.left().face(v, u) < 0) out.error_mm(v, u) = kNan;
      if (std::isfinite(out.error_mm(v, u))) errors.push_back(out.error_mm(v, u));
    }
  }
  if (errors.empty()) return fail(ErrorCode::not_found, "{}: nothing is measured in its first view", folder.string());
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  out.error_mm -= *middle;
  return out;
}

}  // namespace scanrig::bench
