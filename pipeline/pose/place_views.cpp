#include "pipeline/pose/place_views.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/pose/view_graph.h"
#include "pipeline/pose/view_pairs.h"
#include "pipeline/registration/refine_poses.h"

namespace scanrig {
namespace {

/// The limits of registration stand in millimetres on objects of about this size: views are taken to it and back.
constexpr double kWorkingSizeMm = 100.0;
/// Standard deviation of depth in pixels of a range image, where nothing else is known: a scanner is built to resolve
/// what it samples. Of Stanford's scans it is 0.17.
constexpr double kNoisePixels = 0.17;

/// A view taken to the working size, its frame's origin in the middle of what it measured:
/// p_working = scale * (p_own - middle).
struct WorkingViews {
  std::vector<View> views;
  std::vector<Eigen::Vector3d> middles;  ///< mm, own frames
  double scale = 1.0;
};

Eigen::AlignedBox3d box_of(const View& view) {
  Eigen::AlignedBox3d box;
  const Transform own_from_camera = view.range.camera_from_pose.inverse();
  for (const SurfacePoint& s : sample_image(view.range, 4000)) box.extend(own_from_camera * s.point);
  return box;
}

View working_view(const View& view, const Eigen::Vector3d& middle, double scale) {
  View w = view;
  RangeImage& range = w.range;
  const Eigen::Vector3d shift = range.camera_from_pose * middle;
  range.camera_from_pose.translation() = scale * shift;
  range.depth = cv::Mat1f(view.range.depth * scale);  // an expression would be written into the pixels that both share
  if (range.projection.kind == Projection::Kind::orthographic) {
    range.projection.fx /= scale;
    range.projection.fy /= scale;
    const Eigen::Vector2d pixel_mm(1.0 / range.projection.fx, 1.0 / range.projection.fy);
    range.sigma = cv::Mat1f(view.range.depth.size());
    for (int row = 0; row < range.sigma.rows; ++row) {
      for (int col = 0; col < range.sigma.cols; ++col) {
        const float facing = -range.normal(row, col)[2];
        range.sigma(row, col) = static_cast<float>(kNoisePixels * pixel_mm.mean()) / facing;
      }
    }
  } else {
    range.sigma = cv::Mat1f(view.range.sigma * scale);
  }
  return w;
}

Result<WorkingViews> working_views(std::span<const View> views) {
  WorkingViews working;
  std::vector<double> sizes;
  for (const View& view : views) {
    const Eigen::AlignedBox3d box = box_of(view);
    if (box.isEmpty() || !(box.diagonal().norm() > 0.0)) {
      return fail(ErrorCode::invalid_input, "view {} has no measured surface", view.index + 1);
    }
    working.middles.push_back(box.center());
    sizes.push_back(box.diagonal().norm());
  }
  working.scale = kWorkingSizeMm / quantile(std::move(sizes), 0.5);
  for (std::size_t v = 0; v < views.size(); ++v) {
    working.views.push_back(working_view(views[v], working.middles[v], working.scale));
  }
  return working;
}

std::vector<PoseLink> links_of(const ViewPairs& pairs, const ViewSet& set, double min_link) {
  const std::size_t count = set.views.size();
  std::vector<PoseLink> all;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) all.push_back({.pose1 = a, .pose2 = b});
  }
  std::vector<char> holds(all.size(), 0);
  parallel_for(all.size(), [&](std::size_t i) {
    const auto& [a, b] = std::pair(all[i].pose1, all[i].pose2);
    const PairVerdict verdict =
        pairs.judge(set.views[a], set.views[b], set.model_from_view[a].inverse() * set.model_from_view[b]);
    holds[i] = verdict.kind == PairVerdict::Kind::agrees && verdict.confirmed >= min_link ? 1 : 0;
  });
  std::vector<PoseLink> links;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::pair pair(set.views[all[i].pose1], set.views[all[i].pose2]);
    if (holds[i] != 0 || std::ranges::find(set.tree, pair) != set.tree.end()) links.push_back(all[i]);
  }
  return links;
}

/// All views of the set onto each other. They are aligned in pairs: the two finest levels are enough.
Result<RefinedPoses> refine_set(const WorkingViews& working, const ViewSet& set, std::span<const PoseLink> links,
                                const Context& context) {
  RefineOptions refine;
  refine.levels = 2;
  refine.capture_mm = 0.03 * kWorkingSizeMm;
  refine.max_iterations = 12;
  refine.settled_mm = 1e-3;
  std::vector<std::span<const View>> blocks;
  for (const std::size_t v : set.views) blocks.push_back(std::span(working.views).subspan(v, 1));
  return refine_poses(blocks, set.model_from_view, links, refine, context);
}

struct RefinedSet {
  std::vector<PoseLink> links;
  RefinedPoses poses;
};

/// A link may lose its overlap on the way: then weak links are left out. Those of the tree stay.
Result<RefinedSet> refine_by_links(const ViewPairs& pairs, const WorkingViews& working, const ViewSet& set,
                                   const PlaceViewsOptions& options, const Context& context) {
  for (double min_link = options.min_link;; min_link *= 2.0) {
    RefinedSet refined{links_of(pairs, set, min_link), {}};
    auto poses = refine_set(working, set, refined.links, context);
    const bool is_bare = refined.links.size() == set.tree.size();
    if (!poses && (is_bare || poses.error().code != ErrorCode::no_overlap)) return pass_on(poses);
    if (!poses) continue;
    refined.poses = std::move(*poses);
    return refined;
  }
}

Transform to_own(const WorkingViews& working, const Transform& model_from_working, std::size_t view) {
  Transform model_from_own = model_from_working;
  model_from_own.translation() =
      model_from_working.translation() / working.scale - model_from_working.linear() * working.middles[view];
  return model_from_own;
}

PlacedViews described(const WorkingViews& working, const ViewSet& set, std::span<const PoseLink> links,
                      const RefinedPoses& refined) {
  PlacedViews placed;
  placed.model_from_view.resize(working.views.size());
  placed.median_mm = refined.median_mm / working.scale;
  for (std::size_t i = 0; i < links.size(); ++i) {
    placed.links.push_back({set.views[links[i].pose1], set.views[links[i].pose2], refined.links[i].overlap,
                            refined.links[i].median_mm / working.scale});
  }
  const Transform first_from_model = to_own(working, refined.model_from_pose.front(), set.views.front()).inverse();
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    placed.model_from_view[set.views[i]] = first_from_model * to_own(working, refined.model_from_pose[i], set.views[i]);
  }
  placed.model_from_view[set.views.front()] = Transform::Identity();
  return placed;
}

}  // namespace

Result<PlacedViews> place_views(std::span<const View> views, const PlaceViewsOptions& options, const Context& context) {
  if (views.size() < 2 || views.size() > kMaxUnknownViews) {
    return fail(ErrorCode::invalid_input, "2 to {} views can be placed, not {}", kMaxUnknownViews, views.size());
  }
  const auto working = working_views(views);
  if (!working) return pass_on(working);
  ViewPairs pairs(working->views, {});
  const auto motions = pairs.match(context);
  if (!motions) return pass_on(motions);
  const PairJudge judge = [&](std::size_t a, std::size_t b, const Transform& m) { return pairs.judge(a, b, m); };
  const std::vector<ViewSet> sets = join_views(views.size(), *motions, judge, pairs.graph_options());
  if (sets.empty()) return PlacedViews{.model_from_view = std::vector<std::optional<Transform>>(views.size())};
  const auto refined = refine_by_links(pairs, *working, sets.front(), options, context);
  if (!refined) return pass_on(refined);
  PlacedViews placed = described(*working, sets.front(), refined->links, refined->poses);
  placed.motions = motions->size();
  return placed;
}

}  // namespace scanrig
