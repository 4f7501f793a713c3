#include "pipeline/acceptance/acceptance.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace scanrig::acceptance {
namespace {

constexpr double kCoverage = 2.0;  // of expanded uncertainties

/// Results of one measurement, with what they have in common.
class Results {
 public:
  Results(const Artefact& artefact, const Limits& limits) : artefact_(artefact), limits_(limits) {}

  /// `sigma_mm`: of the measured points.
  void add(const std::string& name, const std::string& feature, double value_mm, double sigma_mm) {
    AcceptanceResult result{.name = name, .feature = feature, .value_mm = value_mm};
    result.expanded_uncertainty_mm = std::hypot(kCoverage * sigma_mm, artefact_.expanded_uncertainty_mm);
    if (const auto limit = limits_.find(name); limit != limits_.end()) result.limit_mm = limit->second;
    found_.results.push_back(std::move(result));
  }

  void add_feature(const MeasuredSurface& surface, Feature feature) {
    for (const auto& [points, residuals] : {std::pair(&feature.fit.points, &feature.fit.residuals_mm),
                                            std::pair(&feature.fit.left_out, &feature.fit.left_out_mm)}) {
      for (const std::uint32_t i : *points) feature.points.push_back(surface.points[i]);
      feature.residuals_mm.insert(feature.residuals_mm.end(), residuals->begin(), residuals->end());
    }
    found_.features.push_back(std::move(feature));
  }

  Acceptance take() { return std::move(found_); }

 private:
  const Artefact& artefact_;
  const Limits& limits_;
  Acceptance found_;
};

void add_ball(const MeasuredSurface& surface, const Artefact& artefact, const std::string& name,
              const FoundSphere& ball, Results& results) {
  results.add("form", name, ball.fit.range_mm(), ball.fit.range_sigma_mm());
  results.add("size", name, 2.0 * ball.fit.radius_mm - artefact.diameter_mm,
              2.0 * std::sqrt(ball.fit.covariance(3, 3)));
  results.add_feature(surface, {.name = name,
                                .area_mm2 = ball.region.area_mm2,
                                .seen_share = ball.seen_share,
                                .diameter_mm = 2.0 * ball.fit.radius_mm,
                                .at_rim = ball.region.at_rim,
                                .centre = ball.fit.centre,
                                .fit = ball.fit});
}

Result<void> measure_balls(const MeasuredSurface& surface, const Artefact& artefact, Results& results) {
  const bool is_bar = artefact.kind == Kind::ball_bar;
  const auto balls = find_spheres(surface, {.diameter_mm = artefact.diameter_mm, .count = is_bar ? std::size_t{2} : 1});
  if (!balls) return pass_on(balls);
  if (!is_bar) {
    add_ball(surface, artefact, "sphere", balls->front(), results);
    return {};
  }
  const Eigen::Vector3d between = balls->at(1).fit.centre - balls->at(0).fit.centre;
  const double length = between.norm();
  // Centres as far off as this are those of another bar.
  if (std::abs(length - artefact.length_mm) > 0.1 * artefact.diameter_mm) {
    return fail(ErrorCode::not_found, "no balls {:.3f} mm apart: those found are {:.3f} mm apart; check --length",
                artefact.length_mm, length);
  }
  const Eigen::Vector3d along = between / length;
  double variance = 0.0;
  for (const FoundSphere& ball : *balls) variance += along.dot(ball.fit.covariance.topLeftCorner<3, 3>() * along);
  results.add("spacing", "", length - artefact.length_mm, std::sqrt(variance));
  for (std::size_t k = 0; k < balls->size(); ++k) {
    add_ball(surface, artefact, fmt::format("ball {}", k + 1), balls->at(k), results);
  }
  return {};
}

void add_face(const MeasuredSurface& surface, const FoundPlanes& found, std::size_t k, const std::string& name,
              Results& results) {
  const PlaneFit& plane = found.fit.planes[k];
  results.add("flatness", name, plane.range_mm(), plane.range_sigma_mm());
  results.add_feature(surface, {.name = name,
                                .area_mm2 = found.regions[k].area_mm2,
                                .at_rim = found.regions[k].at_rim,
                                .centre = plane.offset_mm * found.fit.normal,
                                .normal = found.fit.normal,
                                .fit = plane});
}

Result<void> measure_faces(const MeasuredSurface& surface, const Artefact& artefact, Results& results) {
  if (artefact.kind == Kind::plane) {
    const auto face = find_plane(surface);
    if (!face) return pass_on(face);
    add_face(surface, *face, 0, "face", results);
    return {};
  }
  const auto steps = find_steps(surface, artefact.heights_mm);
  if (!steps) return pass_on(steps);
  const Eigen::MatrixXd& covariance = steps->fit.covariance;
  for (std::size_t k = 0; k < artefact.heights_mm.size(); ++k) {
    const double height = steps->fit.planes[k + 1].offset_mm - steps->fit.planes[0].offset_mm;
    const auto at = static_cast<Eigen::Index>(k + 1);
    const double variance = covariance(0, 0) + covariance(at, at) - 2.0 * covariance(0, at);
    results.add("step", fmt::format("step {}", k + 1), height - artefact.heights_mm[k], std::sqrt(variance));
  }
  for (std::size_t k = 0; k < steps->fit.planes.size(); ++k) {
    add_face(surface, *steps, k, k == 0 ? std::string("lowest step") : fmt::format("step {}", k), results);
  }
  return {};
}

bool is_length(double mm) { return std::isfinite(mm) && mm > 0.0; }

}  // namespace

std::string_view to_string(Kind kind) {
  switch (kind) {
    case Kind::sphere: return "sphere";
    case Kind::ball_bar: return "ball-bar";
    case Kind::plane: return "plane";
    case Kind::step_gauge: return "step-gauge";
  }
  return "";
}

std::vector<std::string> result_names(Kind kind) {
  switch (kind) {
    case Kind::sphere: return {"form", "size"};
    case Kind::ball_bar: return {"spacing", "form", "size"};
    case Kind::plane: return {"flatness"};
    case Kind::step_gauge: return {"step", "flatness"};
  }
  return {};
}

Verdict AcceptanceResult::verdict() const {
  if (!limit_mm) return Verdict::none;
  return std::abs(value_mm) <= *limit_mm ? Verdict::pass : Verdict::fail;
}

bool AcceptanceResult::is_close() const {
  return limit_mm && std::abs(std::abs(value_mm) - *limit_mm) < expanded_uncertainty_mm;
}

bool Acceptance::passes() const {
  return std::ranges::none_of(results, [](const auto& result) { return result.verdict() == Verdict::fail; });
}

Result<void> check_artefact(const Artefact& artefact, const Limits& limits) {
  const bool has_balls = artefact.kind == Kind::sphere || artefact.kind == Kind::ball_bar;
  if (has_balls && !is_length(artefact.diameter_mm)) {
    return fail(ErrorCode::invalid_input, "diameter {} mm: must be above 0, as the certificate states it",
                artefact.diameter_mm);
  }
  if (artefact.kind == Kind::ball_bar &&
      !(artefact.length_mm >= artefact.diameter_mm && is_length(artefact.length_mm))) {
    return fail(ErrorCode::invalid_input,
                "length {} mm: must be the distance of the balls' centres, a diameter at least", artefact.length_mm);
  }
  if (artefact.kind == Kind::step_gauge) {
    double below = 0.0;
    for (const double height : artefact.heights_mm) {
      if (!is_length(height) || !(height > below)) {
        return fail(ErrorCode::invalid_input, "heights {}: must be above 0 and ascend, over the lowest step",
                    fmt::join(artefact.heights_mm, ", "));
      }
      below = height;
    }
    if (artefact.heights_mm.empty()) {
      return fail(ErrorCode::invalid_input, "heights: none; give those of the steps over the lowest one");
    }
  }
  if (!(artefact.expanded_uncertainty_mm >= 0.0)) {
    return fail(ErrorCode::invalid_input, "uncertainty {} mm: must not be negative", artefact.expanded_uncertainty_mm);
  }
  const auto names = result_names(artefact.kind);
  for (const auto& [name, limit] : limits) {
    if (std::ranges::find(names, name) == names.end()) {
      return fail(ErrorCode::invalid_input, "limit {}: a {} has no such result; choose from {}", name,
                  to_string(artefact.kind), fmt::join(names, ", "));
    }
    if (!is_length(limit)) return fail(ErrorCode::invalid_input, "limit {}={}: must be above 0 mm", name, limit);
  }
  return {};
}

Result<Acceptance> measure(const Mesh& model, const Artefact& artefact, const Limits& limits) {
  if (auto possible = check_artefact(artefact, limits); !possible) return pass_on(possible);
  const auto surface = measured_surface(model);
  if (!surface) return pass_on(surface);
  Results results(artefact, limits);
  const bool has_balls = artefact.kind == Kind::sphere || artefact.kind == Kind::ball_bar;
  const auto done = has_balls ? measure_balls(*surface, artefact, results) : measure_faces(*surface, artefact, results);
  if (!done) return pass_on(done);
  return results.take();
}

std::vector<AcceptanceResult> worst_results(const std::vector<Acceptance>& all) {
  std::vector<AcceptanceResult> worst;
  for (const Acceptance& one : all) {
    for (const AcceptanceResult& result : one.results) {
      const auto is_same = [&](const AcceptanceResult& other) {
        return other.name == result.name && other.feature == result.feature;
      };
      const auto known = std::ranges::find_if(worst, is_same);
      if (known == worst.end()) {
        worst.push_back(result);
      } else if (std::abs(result.value_mm) > std::abs(known->value_mm)) {
        *known = result;
      }
    }
  }
  return worst;
}

}  // namespace scanrig::acceptance
