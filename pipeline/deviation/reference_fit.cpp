#include "pipeline/deviation/reference_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/mesh/alignment.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/pose/point_pairs.h"

namespace scanrig {
namespace {

constexpr std::size_t kJudged = 3000;  // points of either surface that judge a motion
constexpr double kMinFacing = 0.5;     // cosine between the normals of points that belong together

/// Points that align and judge: those of one surface, and the other surface that they are compared with.
struct ComparedSide {
  std::vector<SurfaceSample> samples;
  const Mesh& other;
  const SurfaceIndex& other_index;
};

struct ProposedMotion {
  Transform reference_from_model;
  double cost = 0.0;
};

struct AlignmentRound {
  std::size_t samples, keep;
  int iterations;
};
constexpr std::array<AlignmentRound, 2> kRounds = {{{400, 8, 12}, {2000, 4, 12}}};

struct ExtentOf {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double size_mm = 0.0;  ///< twice the greatest distance from the centre; the same however the surface is turned
};

ExtentOf extent_of(const std::vector<SurfaceSample>& samples) {
  ExtentOf extent;
  for (const auto& sample : samples) extent.centre += sample.point / static_cast<double>(samples.size());
  for (const auto& sample : samples) {
    extent.size_mm = std::max(extent.size_mm, 2.0 * (sample.point - extent.centre).norm());
  }
  return extent;
}

std::vector<std::uint32_t> all_faces(const Mesh& mesh) {
  std::vector<std::uint32_t> faces(mesh.faces.size());
  std::iota(faces.begin(), faces.end(), 0U);
  return faces;
}

std::vector<SurfaceSample> moved(const std::vector<SurfaceSample>& samples, const Transform& motion,
                                 std::size_t count) {
  const std::size_t stride = std::max<std::size_t>(1, samples.size() / count);
  std::vector<SurfaceSample> result;
  for (std::size_t i = 0; i < samples.size(); i += stride) {
    result.push_back(samples[i]);
    result.back().point = motion * samples[i].point;
    result.back().normal = motion.linear() * samples[i].normal;
  }
  return result;
}

/// Distances of so many of a side's points from the other surface; `far_mm` where it is farther or looks elsewhere.
std::vector<double> distances_of(const ComparedSide& side, const Transform& motion, double far_mm, std::size_t count) {
  const auto points = moved(side.samples, motion, count);
  std::vector<double> distances(points.size(), far_mm);
  parallel_for(points.size() / 256 + 1, [&](std::size_t block) {
    for (std::size_t i = block * 256; i < std::min(points.size(), (block + 1) * 256); ++i) {
      const auto nearest = side.other_index.nearest(points[i].point, far_mm);
      if (!std::isfinite(nearest.distance)) continue;
      const auto& f = side.other.faces[nearest.face];
      const Eigen::Vector3d a = side.other.vertices[f[0]].cast<double>();
      const Eigen::Vector3d normal = (side.other.vertices[f[1]].cast<double>() - a)
                                         .cross(side.other.vertices[f[2]].cast<double>() - a)
                                         .normalized();
      if (normal.dot(points[i].normal) >= kMinFacing) distances[i] = nearest.distance;
    }
  });
  return distances;
}

double share_within(const std::vector<double>& distances, double limit) {
  const auto within = std::ranges::count_if(distances, [limit](double d) { return d <= limit; });
  return static_cast<double>(within) / static_cast<double>(distances.size());
}

class ReferenceSearch {
 public:
  ReferenceSearch(ComparedSide model, ComparedSide reference, double size_mm, const ReferenceFitOptions& options)
      : model_(std::move(model)), reference_(std::move(reference)), size_mm_(size_mm), options_(options) {}

  /// Motions from oriented point pairs, aligned and judged coarse to fine, the best first. Empty: stopped.
  std::vector<ProposedMotion> motions(const Context& context) const {
    const auto surface = [&](const ComparedSide& side) {
      std::vector<SurfacePoint> points;
      for (const auto& one : moved(side.samples, Transform::Identity(), options_.vote_points)) {
        points.push_back({.point = one.point, .normal = one.normal});
      }
      return points;
    };
    std::vector<ProposedMotion> field;
    for (const Vote& vote : vote_by_point_pairs(surface(reference_), surface(model_), size_mm_, options_.motions)) {
      field.push_back({vote.pose1_from_pose2});
    }
    for (const AlignmentRound& round : kRounds) {
      for (ProposedMotion& one : field) {
        if (context.stopped()) return {};
        improve(one, round.samples, round.iterations);
      }
      std::ranges::stable_sort(field, {}, &ProposedMotion::cost);
      field = distinct_motions(field, round.keep);
    }
    return field;
  }

  /// A motion aligned by all samples.
  [[nodiscard]] Transform refined(ProposedMotion motion) const {
    improve(motion, options_.last_samples, AlignmentOptions{}.max_iterations);
    return motion.reference_from_model;
  }
  [[nodiscard]] double confirmed(const Transform& motion) const {
    return share_within(distances_of(model_, motion, far_mm(), kJudged), options_.tolerance * size_mm_);
  }
  [[nodiscard]] double covered(const Transform& motion) const {
    return share_within(distances_of(reference_, motion.inverse(), far_mm(), kJudged), options_.tolerance * size_mm_);
  }
  [[nodiscard]] bool is_same(const Transform& a, const Transform& b) const {
    return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(options_.other_way_deg);
  }

 private:
  [[nodiscard]] double far_mm() const { return options_.cost_cap * size_mm_; }

  void improve(ProposedMotion& one, std::size_t samples, int iterations) const {
    const auto start = moved(model_.samples, one.reference_from_model, samples);
    one.reference_from_model =
        align(start, model_.other, model_.other_index, {.max_iterations = iterations, .max_samples = samples}) *
        one.reference_from_model;
    one.cost =
        cost(model_, one.reference_from_model, samples) + cost(reference_, one.reference_from_model.inverse(), samples);
  }

  /// Mean distance of so many points, those beyond the cap counted as it.
  [[nodiscard]] double cost(const ComparedSide& side, const Transform& motion, std::size_t samples) const {
    const auto distances = distances_of(side, motion, far_mm(), std::min(samples, kJudged));
    return std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());
  }

  [[nodiscard]] std::vector<ProposedMotion> distinct_motions(const std::vector<ProposedMotion>& sorted,
                                                             std::size_t keep) const {
    std::vector<ProposedMotion> kept;
    for (const ProposedMotion& one : sorted) {
      const bool is_known = std::ranges::any_of(kept, [&](const ProposedMotion& other) {
        return is_same(one.reference_from_model, other.reference_from_model);
      });
      if (!is_known && kept.size() < keep) kept.push_back(one);
    }
    return kept;
  }

  ComparedSide model_, reference_;
  double size_mm_;
  const ReferenceFitOptions& options_;
};

/// Both surfaces' points and indices, checked.
Result<std::vector<SurfaceSample>> samples_of(const Mesh& mesh, const std::vector<std::uint32_t>& faces,
                                              std::size_t count, std::string_view what) {
  auto samples = sample_surface(mesh, faces, count);
  if (samples.empty()) return fail(ErrorCode::degenerate, "deviation: {} has no area; scan the part again", what);
  return samples;
}

}  // namespace

Result<ReferenceFit> fit_to_reference(const Mesh& model, const Mesh& reference, const ReferenceFitOptions& options,
                                      const Context& context) {
  auto of_model = samples_of(model, measured_faces(model, true), options.last_samples, "the measured surface");
  if (!of_model) return pass_on(of_model);
  auto of_reference = samples_of(reference, all_faces(reference), kJudged, "the reference");
  if (!of_reference) return pass_on(of_reference);
  const auto extent = extent_of(*of_reference), extent_model = extent_of(*of_model);
  const double ratio = extent_model.size_mm / extent.size_mm;
  if (ratio > options.max_size_ratio || ratio < 1.0 / options.max_size_ratio) {
    return fail(
        ErrorCode::no_overlap,
        "deviation: the reference is {:.3g} mm large and the model {:.3g} mm; add the reference in mm (GLB: in m)",
        extent.size_mm, extent_model.size_mm);
  }
  const auto model_index = SurfaceIndex::create(model), reference_index = SurfaceIndex::create(reference);
  if (!model_index) return pass_on(model_index, "deviation");
  if (!reference_index) return pass_on(reference_index, "deviation");
  const ReferenceSearch search({std::move(*of_model), reference, *reference_index},
                               {std::move(*of_reference), model, *model_index}, extent.size_mm, options);
  const auto motions = search.motions(context);
  if (context.stopped()) return fail(ErrorCode::stopped, "deviation: stopped");
  const auto misfit = [](double confirmed) {
    return fail(ErrorCode::no_overlap,
                "deviation: the reference does not fit: {:.0f} % of the surfaces agree; choose another",
                100.0 * confirmed);
  };
  if (motions.empty()) return misfit(0.0);
  ReferenceFit fit{.reference_from_model = search.refined(motions.front())};
  fit.confirmed = search.confirmed(fit.reference_from_model);
  const double covered = search.covered(fit.reference_from_model);
  if (fit.confirmed < options.min_confirmed || covered < options.min_covered) {
    return misfit(std::min(fit.confirmed, covered));
  }
  fit.fits_otherwise = std::ranges::any_of(motions, [&](const ProposedMotion& other) {
    return !search.is_same(fit.reference_from_model, other.reference_from_model) &&
           other.cost <= options.other_way_cost * motions.front().cost;
  });
  return fit;
}

}  // namespace scanrig
