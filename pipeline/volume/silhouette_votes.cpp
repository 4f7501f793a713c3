#include "pipeline/volume/silhouette_votes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/parallel_blocks.h"
#include "pipeline/range/crop_view.h"
#include "pipeline/silhouette/box_around.h"
#include "pipeline/silhouette/contour_distance.h"
#include "pipeline/volume/integrate.h"
#include "pipeline/volume/posed_outline.h"
#include "pipeline/volume/range_sampler.h"
#include "pipeline/volume/silhouette_surplus.h"

namespace scanrig {
namespace {

struct MeasuredPoint {
  Eigen::Vector3f point;  ///< pose frame
  float sigma;            ///< of its depth, mm
  int views;              ///< that measured it; not counted for points within all outlines
  int outside_of =
      0;  ///< views whose silhouettes put it outside: what is mirrored to one camera of a view is to the other
  bool is_beyond = false;  ///< an outline, if only by what moves it
};

double mm_per_pixel(const RangeImage& range) {
  for (const float depth : range.depth) {
    if (!std::isnan(depth)) return range.projection.mm_per_pixel(static_cast<double>(depth));
  }
  return range.projection.mm_per_pixel(1.0);
}

std::vector<MeasuredPoint> measured_points(std::span<const View> views, const SilhouetteVoteOptions& options) {
  std::vector<std::vector<MeasuredPoint>> of_view(views.size());
  parallel_for(views.size(), [&](std::size_t v) {
    const RangeImage& range = views[v].range;
    const Transform pose_from_camera = range.camera_from_pose.inverse();
    for (int y = 0; y < range.depth.rows; y += options.stride_px) {
      for (int x = 0; x < range.depth.cols; x += options.stride_px) {
        const float depth = range.depth(y, x);
        if (std::isnan(depth)) continue;
        const Eigen::Vector3d point = pose_from_camera * range.projection.unproject(x, y, static_cast<double>(depth));
        of_view[v].push_back({point.cast<float>(), range.sigma(y, x), options.min_views});
      }
    }
  });
  std::vector<MeasuredPoint> all;
  for (const auto& points : of_view) all.insert(all.end(), points.begin(), points.end());
  return all;
}

/// Where the outlines are: `outside_of` and `is_beyond` of every point.
void compare_with_outlines(const std::vector<PosedOutline>& outlines, const SilhouetteVoteOptions& options,
                           std::vector<MeasuredPoint>& points) {
  for_each_in_blocks(points.size(), [&](std::size_t i) {
    MeasuredPoint& point = points[i];
    std::optional<std::size_t> last;  // outlines are in the order of views
    for (const PosedOutline& outline : outlines) {
      const double outside_px = outline.outside_px(point.point);
      point.is_beyond |= outside_px > options.max_beyond_px;
      if (last == outline.view || !(outside_px > options.contour_px)) continue;
      last = outline.view;
      ++point.outside_of;
    }
  });
}

/// Keeps of the points beyond an outline those that at least `min_views` views measured, and more than see through them
/// to surface behind. Views agree within their sigmas, or half a pixel: a silhouette resolves no more.
class ConfirmingViews {
 public:
  ConfirmingViews(std::span<const View> views, const SilhouetteVoteOptions& options) : options_(options) {
    pixel_mm_ = static_cast<float>(mm_per_pixel(views.front().range));
    const double band = options.contour_px * static_cast<double>(pixel_mm_);
    std::vector<std::optional<RangeSampler>> made(views.size());
    parallel_for(views.size(), [&](std::size_t v) {
      made[v].emplace(views[v].range, Transform::Identity(), band, static_cast<double>(pixel_mm_),
                      RangeSamplerOptions{});
    });
    for (auto& sampler : made) samplers_.push_back(std::move(*sampler));
  }

  void confirm(std::vector<MeasuredPoint>& points) const {
    for_each_in_blocks(points.size(), [&](std::size_t i) {
      if (points[i].is_beyond) points[i].views = views_of(points[i].point, points[i].sigma);
    });
    std::erase_if(points, [&](const MeasuredPoint& point) { return point.views < options_.min_views; });
  }

 private:
  /// 0 where as many see through.
  [[nodiscard]] int views_of(const Eigen::Vector3f& point, float sigma) const {
    int confirmed = 0, seen_through = 0;
    for (const RangeSampler& view : samplers_) {
      const RangeSample s = view.sample(point);
      if (s.kind == RangeSample::Kind::surface) {
        const float tolerance = std::hypot(options_.sigmas * std::hypot(sigma, s.sigma), 0.5F * pixel_mm_);
        if (std::abs(s.distance) <= tolerance) ++confirmed;
      } else if (s.clearly_free && std::isfinite(s.distance)) {
        ++seen_through;
      }
    }
    return confirmed > seen_through ? confirmed : 0;
  }

  SilhouetteVoteOptions options_;
  float pixel_mm_ = 0.0F;
  std::vector<RangeSampler> samplers_;
};

/// Votes on each silhouette: per pixel the number of views that measured a point there which the silhouette puts
/// outside. A point that as many silhouettes put outside has no vote: several silhouettes are right.
struct Votes {
  cv::Mat1b against;  ///< 0: none
  cv::Mat1b surface;  ///< 255 where a measured point beyond an outline lies
};

/// Whether the silhouettes of fewer views than measured it put it outside.
bool has_vote(const MeasuredPoint& point) { return point.outside_of < point.views; }

/// Places where the silhouette was cropped off are left out and returned.
cv::Rect count_votes(const PosedOutline& outline, const std::vector<MeasuredPoint>& points,
                     const SilhouetteVoteOptions& options, Votes& votes) {
  const cv::Mat1f& outside = outline.silhouette->outside_px;
  votes = {cv::Mat1b(outside.size(), uchar{0}), cv::Mat1b(outside.size(), uchar{0})};
  cv::Rect cropped_off;
  for (const MeasuredPoint& point : points) {
    if (!point.is_beyond || !has_vote(point)) continue;
    const auto at = outline.pixel_of(point.point);
    if (!at) continue;
    if (!outline.holds(*at)) {
      cropped_off |= cv::Rect(*at, cv::Size(1, 1));
      continue;
    }
    votes.surface(*at) = 255;
    if (static_cast<double>(outside(*at)) <= options.contour_px) continue;
    votes.against(*at) = std::max(votes.against(*at), cv::saturate_cast<uchar>(point.views));
  }
  return cropped_off;
}

/// A vote on what was cropped off takes it in again.
std::vector<Votes> count_votes(std::span<View> views, const std::vector<PosedOutline>& outlines,
                               const std::vector<MeasuredPoint>& points, const SilhouetteVoteOptions& options) {
  std::vector<Votes> votes(outlines.size());
  parallel_for(outlines.size(), [&](std::size_t s) {
    const PosedOutline& outline = outlines[s];
    const cv::Rect cropped_off = count_votes(outline, points, options, votes[s]);
    if (cropped_off.empty()) return;
    uncrop(views[outline.view], outline.camera, cropped_off);
    count_votes(outline, points, options, votes[s]);
  });
  return votes;
}

cv::Mat disc(int radius) { return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}); }

bool touches_border(const cv::Rect& box, const cv::Size& size) {
  return box.x == 0 || box.y == 0 || box.br().x == size.width || box.br().y == size.height;
}

cv::Rect box_of(const cv::Mat& stats, int part) {
  return {stats.at<int>(part, cv::CC_STAT_LEFT), stats.at<int>(part, cv::CC_STAT_TOP),
          stats.at<int>(part, cv::CC_STAT_WIDTH), stats.at<int>(part, cv::CC_STAT_HEIGHT)};
}

/// Openings of the silhouette whose sure part is contradicted for the most part go whole.
void add_openings(const cv::Mat1f& outside_px, const cv::Mat1b& contradicted, const SilhouetteVoteOptions& options,
                  cv::Mat1b& region) {
  cv::Mat1i labels;
  cv::Mat stats, centroids;
  const int parts = cv::connectedComponentsWithStats(outside_px > 0.0F, labels, stats, centroids, 4, CV_32S);
  for (int part = 1; part < parts; ++part) {
    const cv::Rect box = box_of(stats, part);
    if (touches_border(box, outside_px.size())) continue;
    const cv::Mat1b opening(labels(box) == part);
    const cv::Mat1b sure(opening & (outside_px(box) > options.contour_px));
    const int against = cv::countNonZero(sure & contradicted(box));
    if (against >= options.min_region_px && 2 * against >= cv::countNonZero(sure)) region(box).setTo(255, opening);
  }
}

/// The part of the silhouette's sure outside that measured surface contradicts.
cv::Mat1b contradicted_part(const cv::Mat1f& outside_px, const cv::Mat1b& against,
                            const SilhouetteVoteOptions& options) {
  cv::Mat1b joined;  // votes lie a stride apart, on surface seen at an angle farther
  cv::morphologyEx(against > 0, joined, cv::MORPH_CLOSE, disc(2 * options.stride_px));
  joined &= outside_px > options.contour_px;
  cv::Mat1i labels;
  cv::Mat stats, centroids;
  const int parts = cv::connectedComponentsWithStats(joined, labels, stats, centroids, 8, CV_32S);
  cv::Mat1b contradicted(outside_px.size(), uchar{0});
  for (int part = 1; part < parts; ++part) {
    if (stats.at<int>(part, cv::CC_STAT_AREA) < options.min_region_px) continue;
    contradicted.setTo(255, labels == part);
  }
  return contradicted;
}

/// That part with the contour's own uncertainty around it, and openings that it refutes.
cv::Mat1b region_to_mend(const cv::Mat1f& outside_px, const cv::Mat1b& contradicted,
                         const SilhouetteVoteOptions& options) {
  cv::Mat1b region;  // and a pixel
  cv::dilate(contradicted, region, disc(static_cast<int>(std::ceil(options.contour_px)) + 1));
  region &= outside_px > 0.0F;
  add_openings(outside_px, contradicted, options, region);
  return region;
}

/// Where measured surface reaches beyond the outline: at the rim of a dark object, which mirrors the screen, by several
/// pixels all around, and over creases that do.
cv::Mat1b covered_rim(const cv::Mat1f& outside_px, const cv::Mat1b& surface, const SilhouetteVoteOptions& options) {
  cv::Mat1b covered(surface & (outside_px > options.max_beyond_px)), beside;
  cv::morphologyEx(covered, covered, cv::MORPH_CLOSE, disc(options.stride_px));
  covered &= outside_px > options.max_beyond_px;
  cv::dilate(covered, beside, disc(static_cast<int>(std::ceil(options.max_beyond_px)) + 1));
  beside &= outside_px <= options.max_beyond_px;
  beside &= outside_px > 0.0F;
  beside |= covered;
  return beside;
}

int median_votes(const cv::Mat1b& against, const cv::Mat1b& region) {
  std::vector<uchar> votes;
  for (int y = 0; y < against.rows; ++y) {
    for (int x = 0; x < against.cols; ++x) {
      if (region(y, x) != 0 && against(y, x) != 0) votes.push_back(against(y, x));
    }
  }
  if (votes.empty()) return 0;
  const auto middle = votes.begin() + static_cast<std::ptrdiff_t>(votes.size() / 2);
  std::nth_element(votes.begin(), middle, votes.end());
  return *middle;
}

/// Free space in the left camera's range image came from the silhouette too.
void forget_background(View& view, std::size_t camera, const cv::Mat1b& region) {
  if (camera != 0 || view.range.background.size() != region.size()) return;
  view.range.background = view.range.background.clone();
  view.range.background.setTo(0, region);
}

/// Where the outline and the votes are, and so much around that farther out only "far outside" matters.
cv::Rect box_to_mend(const cv::Mat1f& outside_px, const Votes& votes) {
  return box_around(cv::Mat1b((outside_px <= 0.0F) | votes.surface | votes.against), kCropRoomPx);
}

/// Where measured points lie in the image.
cv::Mat1b object_seen(const PosedOutline& outline, const std::vector<MeasuredPoint>& points,
                      const SilhouetteVoteOptions& options) {
  cv::Mat1b object(outline.silhouette->outside_px.size(), uchar{0});
  for (const MeasuredPoint& point : points) {
    const auto at = has_vote(point) ? outline.pixel_of(point.point) : std::nullopt;
    if (at && outline.holds(*at)) object(*at) = 255;
  }
  cv::morphologyEx(object, object, cv::MORPH_CLOSE, disc(2 * options.stride_px));
  return object;
}

double share_of_object(const cv::Mat1b& region, const cv::Mat1b& object) {
  return std::min(1.0, cv::countNonZero(region & object) / std::max(1.0, 1.0 * cv::countNonZero(object)));
}

/// The rim is mended without a word: it is no single image's.
std::optional<SilhouetteFinding> mend(const PosedOutline& outline, View& view, const Votes& votes,
                                      const std::vector<MeasuredPoint>& points, const SilhouetteVoteOptions& options) {
  cv::Mat1f all = outline.silhouette->outside_px.clone();  // copies of a view share their pixels
  const cv::Rect box = box_to_mend(all, votes);
  if (box.empty()) return std::nullopt;
  cv::Mat1f outside(all, box);
  const cv::Mat1b against(votes.against, box), surface(votes.surface, box);
  const cv::Mat1b contradicted = contradicted_part(outside, against, options);
  const cv::Mat1b region = region_to_mend(outside, contradicted, options);
  const cv::Mat1b mended(region | covered_rim(outside, surface, options));
  if (cv::countNonZero(mended) == 0) return std::nullopt;
  SilhouetteFinding finding{.view = view.index, .camera = outline.camera, .views = median_votes(against, region)};
  finding.area_px = cv::countNonZero(region);
  if (finding.area_px > 0.0) finding.share = share_of_object(region, object_seen(outline, points, options)(box));
  cv::Mat1b all_mended(all.size(), uchar{0});
  if (finding.share > options.max_contradicted) {
    finding.kind = SilhouetteFinding::Kind::whole;
    all_mended.setTo(255);
    all.setTo(-std::numeric_limits<float>::max());
  } else {
    mended.copyTo(all_mended(box));
    outside.setTo(-1.0F, mended);
    contour_distance(outside).copyTo(outside);
  }
  outline.silhouette->outside_px = all;
  forget_background(view, outline.camera, all_mended);
  if (cv::countNonZero(contradicted) == 0) return std::nullopt;
  return finding;
}

}  // namespace

Result<SilhouetteVerdict> vote_on_silhouettes(std::span<View> views, const SilhouetteVoteOptions& options,
                                              const Context& context) {
  SilhouetteVerdict verdict;
  const std::vector<PosedOutline> outlines = outlines_of(views);
  if (outlines.empty()) return verdict;
  std::vector<MeasuredPoint> points = measured_points(views, options);
  compare_with_outlines(outlines, options, points);
  if (std::ranges::any_of(points, &MeasuredPoint::is_beyond)) ConfirmingViews(views, options).confirm(points);
  if (context.stopped()) return fail(ErrorCode::stopped, "silhouettes: stopped");
  if (points.empty()) return verdict;
  const auto disputed = std::ranges::count_if(
      points, [&](const MeasuredPoint& point) { return point.outside_of >= options.min_disputing; });
  verdict.disputed_share = static_cast<double>(disputed) / static_cast<double>(points.size());
  const std::vector<Votes> votes = count_votes(views, outlines, points, options);
  std::vector<std::optional<SilhouetteFinding>> mended(outlines.size()), surplus(outlines.size());
  parallel_for(outlines.size(), [&](std::size_t s) {
    mended[s] = mend(outlines[s], views[outlines[s].view], votes[s], points, options);
  });
  if (context.stopped()) return fail(ErrorCode::stopped, "silhouettes: stopped");
  if (options.finds_surplus) {
    Eigen::AlignedBox3f box;
    for (const MeasuredPoint& point : points) box.extend(point.point);
    const auto room = Eigen::Vector3f::Constant(static_cast<float>(VolumeOptions{}.hull_room_mm));
    const Surplus rays(outlines, {box.min() - room, box.max() + room}, options);
    parallel_for(outlines.size(), [&](std::size_t s) { surplus[s] = rays.of(s, views[outlines[s].view]); });
  }
  for (std::size_t s = 0; s < outlines.size(); ++s) {
    if (mended[s]) verdict.findings.push_back(*mended[s]);
    if (surplus[s] && !mended[s]) verdict.findings.push_back(*surplus[s]);
  }
  return verdict;
}

}  // namespace scanrig
