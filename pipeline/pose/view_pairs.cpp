#include "pipeline/pose/view_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/units.h"

namespace scanrig {
namespace {

constexpr int kFineLevel = 1;  ///< of the range pyramid: the verdict's
constexpr std::size_t kMotionsPerPair = 3;
constexpr std::size_t kPairsAtOnce = 32;  ///< between two reports of the progress

/// Confirmations fade with the distance: a ranking for motions that are still degrees off.
double ranking(const std::vector<SampleCheck>& checks, double reach_mm) {
  double sum = 0.0;
  for (const SampleCheck& check : checks) {
    if (check.kind == SampleCheck::Kind::free_space) sum -= 1.0;
    if (check.kind == SampleCheck::Kind::surface) sum += 1.0 - std::abs(check.distance_mm) / reach_mm;
  }
  return sum / static_cast<double>(std::max<std::size_t>(checks.size(), 1));
}

/// Confirmed surface, less what contradicts: Kruskal's order.
double quality(const Agreement& a) { return std::max(a.score(2.0), 0.0); }

/// How far single pixels lie off the line between their neighbours in a row: noise, and relief as fine as that.
double roughness_mm(const RangeImage& image) {
  constexpr float kMaxStepPixels = 4.0F;  // beyond it the neighbours lie on other surface
  const auto max_step = kMaxStepPixels * static_cast<float>(image.projection.mm_per_pixel(1.0));
  std::vector<double> off;
  for (int row = 0; row < image.depth.rows; ++row) {
    for (int col = 1; col + 1 < image.depth.cols; ++col) {
      const float left = image.depth(row, col - 1), right = image.depth(row, col + 1);
      const float distance = image.depth(row, col) - 0.5F * (left + right);
      if (std::isnan(distance)) continue;
      const float step = image.projection.kind == Projection::Kind::pinhole ? max_step * left : max_step;
      if (std::abs(right - left) < step) off.push_back(std::abs(distance));
    }
  }
  return off.empty() ? 0.0 : quantile(std::move(off), 0.5);
}

double pixel_mm(const MeasuredPose& measured) {
  const auto& samples = measured.samples.front();
  if (samples.empty()) return 0.0;
  const RangeImage& image = measured.images.front().front();
  return image.projection.mm_per_pixel((image.camera_from_pose * samples[samples.size() / 2].point).z());
}

}  // namespace

ViewPairs::ViewPairs(std::span<const View> views, const ViewPairOptions& options)
    : views_(views), options_(options), measured_(views.size()) {
  parallel_for(views.size(), [&](std::size_t v) { measured_[v] = measured_pose(view(v), options_.levels); });
  std::vector<double> sizes, roughness, pixels;
  for (const MeasuredPose& measured : measured_) {
    sizes.push_back(measured.size_mm);
    roughness.push_back(roughness_mm(measured.images.front().front()));
    pixels.push_back(pixel_mm(measured));
  }
  size_mm_ = quantile(std::move(sizes), 0.5);
  const double fine = std::max(options.max_roughness * quantile(std::move(roughness), 0.5),
                               options.min_pixels * quantile(std::move(pixels), 0.5));
  max_median_mm_ = std::min(options.max_median * size_mm_, fine);
  graph_options_ = {.same_deg = options.same_deg,
                    .same_mm = options.same_shift * size_mm_,
                    .arm_mm = 0.4 * size_mm_,
                    .rival_share = 0.7};
}

ViewFitCheck ViewPairs::check(std::size_t view1, std::size_t view2, const Transform& motion, int level,
                              double reach) const {
  const PoseObservations first{&measured_[view1], view(view1)}, second{&measured_[view2], view(view2)};
  return {motion, check_samples(first, second, motion, level, reach * size_mm_, options_.agreement), 0.0};
}

void ViewPairs::align_near(std::size_t view1, std::size_t view2, int level, double capture, ViewFitCheck& fit) const {
  RefineOptions refine;
  refine.max_iterations = options_.iterations;
  const RefinedPose found =
      align(measured_[view1], measured_[view2], fit.view1_from_view2, level, capture * size_mm_, refine);
  fit.view1_from_view2 = found.pose1_from_pose2;
  fit.condition = found.iterations > 0 ? found.condition : std::numeric_limits<double>::infinity();
}

/// Checks all; the best distinct ones are kept.
void ViewPairs::narrow(std::size_t view1, std::size_t view2, int level, double reach, std::size_t keep,
                       std::vector<ViewFitCheck>& field) const {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < field.size(); ++i) {
    field[i].checks = check(view1, view2, field[i].view1_from_view2, level, reach).checks;
    order.emplace_back(-ranking(field[i].checks, reach * size_mm_), i);
  }
  std::ranges::sort(order);
  std::vector<ViewFitCheck> kept;
  for (const auto& ranked : order) {
    if (kept.size() == keep) break;
    ViewFitCheck& candidate = field[ranked.second];
    const bool is_known = std::ranges::any_of(kept, [&](const ViewFitCheck& k) {
      return alike(k.view1_from_view2, candidate.view1_from_view2, graph_options_);
    });
    if (!is_known) kept.push_back(std::move(candidate));
  }
  field = std::move(kept);
}

std::vector<ViewFitCheck> ViewPairs::search(std::size_t view1, std::size_t view2) const {
  const int coarsest = options_.levels - 1, middle = options_.levels - 2;
  std::vector<ViewFitCheck> field;
  for (const Vote& vote : tables_[view1].vote(measured_[view2].samples[middle], options_.proposals)) {
    field.push_back({vote.pose1_from_pose2, {}, 0.0});
  }
  narrow(view1, view2, coarsest, options_.proposal_reach, options_.kept_coarse, field);
  for (ViewFitCheck& fit : field) align_near(view1, view2, middle, options_.coarse_capture, fit);
  narrow(view1, view2, middle, options_.coarse_reach, options_.kept_middle, field);
  for (ViewFitCheck& fit : field) align_near(view1, view2, kFineLevel, options_.fine_capture, fit);
  narrow(view1, view2, kFineLevel, options_.fine_reach, kMotionsPerPair, field);
  return field;
}

/// All views come from one scanner: what the best fit of each view leaves is its noise.
void ViewPairs::measure_spread(std::span<const std::vector<ViewFitCheck>> fits) {
  std::vector<double> best(views_.size(), std::numeric_limits<double>::infinity());
  std::size_t pair = 0;
  for (std::size_t a = 0; a < views_.size(); ++a) {
    for (std::size_t b = a + 1; b < views_.size(); ++b, ++pair) {
      for (const ViewFitCheck& fit : fits[pair]) {
        const Agreement loose =
            count_agreement(fit.checks, std::numeric_limits<double>::infinity(), options_.agreement);
        if (loose.confirmed < options_.min_confirmed) continue;
        best[a] = std::min(best[a], loose.median_mm);
        best[b] = std::min(best[b], loose.median_mm);
      }
    }
  }
  std::erase_if(best, [](double median) { return !std::isfinite(median); });
  const double median = best.empty() ? max_median_mm_ : quantile(std::move(best), 0.5);
  spread_mm_ = options_.spread_of_median * std::min(median, max_median_mm_);
}

bool ViewPairs::fits(const Agreement& agreement, double condition) const {
  return agreement.confirmed >= options_.min_confirmed && agreement.contradicted_share() <= options_.max_contradicted &&
         agreement.median_mm <= max_median_mm_ && condition <= options_.max_condition;
}

Result<std::vector<PairMotion>> ViewPairs::match(const Context& context) {
  tables_.clear();
  for (const MeasuredPose& measured : measured_) {
    tables_.emplace_back(measured.samples[options_.levels - 2], size_mm_, options_.voting);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < views_.size(); ++a) {
    for (std::size_t b = a + 1; b < views_.size(); ++b) pairs.emplace_back(a, b);
  }
  std::vector<std::vector<ViewFitCheck>> found(pairs.size());
  for (std::size_t first = 0; first < pairs.size(); first += kPairsAtOnce) {
    if (context.stopped()) return fail(ErrorCode::stopped, "stopped by request");
    parallel_for(std::min(kPairsAtOnce, pairs.size() - first),
                 [&](std::size_t i) { found[first + i] = search(pairs[first + i].first, pairs[first + i].second); });
    context.report("pairs", static_cast<double>(first) / static_cast<double>(pairs.size()));
  }
  context.report("pairs", 1.0);
  measure_spread(found);
  std::vector<PairMotion> motions;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    for (const ViewFitCheck& fit : found[p]) {
      const Agreement agreement = count_agreement(fit.checks, spread_mm_, options_.agreement);
      if (!fits(agreement, fit.condition)) continue;
      motions.push_back({pairs[p].first, pairs[p].second, fit.view1_from_view2, quality(agreement), true, false});
    }
  }
  std::ranges::stable_sort(motions, [](const PairMotion& a, const PairMotion& b) { return a.confirmed > b.confirmed; });
  return motions;
}

PairVerdict ViewPairs::judge(std::size_t view1, std::size_t view2, const Transform& view1_from_view2) const {
  using Kind = PairVerdict::Kind;
  ViewFitCheck near{view1_from_view2, {}, 0.0};
  align_near(view1, view2, kFineLevel, options_.fine_capture, near);
  if (alike(near.view1_from_view2, view1_from_view2, graph_options_)) {
    const auto checks = check(view1, view2, near.view1_from_view2, kFineLevel, options_.fine_reach).checks;
    const Agreement agreement = count_agreement(checks, spread_mm_, options_.agreement);
    if (fits(agreement, 0.0)) return {Kind::agrees, agreement.confirmed, agreement.contradicted};
  }
  // Nothing to align by: where they stand as the other pairs say, give or take the others' errors.
  const auto checks = check(view1, view2, view1_from_view2, kFineLevel, options_.coarse_reach).checks;
  const Agreement agreement = count_agreement(checks, std::numeric_limits<double>::infinity(), options_.agreement);
  const double allowed = std::max(options_.max_contradicted * agreement.confirmed, options_.max_tolerated);
  return {agreement.contradicted <= allowed ? Kind::apart : Kind::contradicts, agreement.confirmed,
          agreement.contradicted};
}

}  // namespace scanrig
