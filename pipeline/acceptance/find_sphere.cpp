#include "pipeline/acceptance/find_sphere.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "core/units.h"

namespace scanrig::acceptance {
namespace {

using Eigen::Vector3d;

constexpr double kCellShare = 0.2;  // of the radius: a cell of votes; normals may be wrong by 0.2 rad
constexpr int kMaxRounds = 20;

using Cell = std::array<int, 3>;

/// Centres proposed in one cell.
struct Vote {
  double area = 0.0;
  Vector3d sum = Vector3d::Zero();  ///< of the centres, by area
};

/// Proposed centres, by area.
class Votes {
 public:
  Votes(const MeasuredSurface& surface, double radius)
      : surface_(surface), radius_(radius), cell_(kCellShare * radius) {
    for (std::uint32_t i = 0; i < surface.size(); ++i) {
      if (!(surface.area_mm2[i] > 0.0)) continue;
      Vote& vote = cells_.try_emplace(cell_of(centre_of(i))).first->second;
      vote.area += surface.area_mm2[i];
      vote.sum += surface.area_mm2[i] * centre_of(i);
    }
  }

  /// Where most area agrees, farther than a diameter from each of `taken`.
  [[nodiscard]] std::optional<Vector3d> best(const std::vector<Vector3d>& taken) const {
    double most = 0.0;
    std::optional<Vector3d> found;
    for (const auto& [cell, vote] : cells_) {
      const Vector3d at = vote.sum / vote.area;
      const auto is_taken = [&](const Vector3d& other) { return (at - other).norm() < 2.0 * radius_ - cell_; };
      if (std::ranges::any_of(taken, is_taken)) continue;
      // Of all cells around one centre, that with most of it: others begin too far from it to settle there.
      const double around = area_around(cell) + vote.area;
      if (around > most) {
        most = around;
        found = at;
      }
    }
    return found ? std::optional(settled(*found)) : std::nullopt;
  }

 private:
  [[nodiscard]] Vector3d centre_of(std::uint32_t i) const { return surface_.points[i] - radius_ * surface_.normals[i]; }
  [[nodiscard]] Cell cell_of(const Vector3d& p) const {
    const Eigen::Vector3i floor = (p / cell_).array().floor().cast<int>();
    return {floor.x(), floor.y(), floor.z()};
  }
  [[nodiscard]] double area_around(const Cell& cell) const {
    double area = 0.0;
    for (int k = 0; k < 27; ++k) {
      const auto found = cells_.find({cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1});
      if (found != cells_.end()) area += found->second.area;
    }
    return area;
  }
  /// Mean of the centres proposed near `at`, moved until it stays.
  [[nodiscard]] Vector3d settled(Vector3d at) const {
    for (int round = 0; round < kMaxRounds; ++round) {
      Vector3d sum = Vector3d::Zero();
      double weight = 0.0;
      for (std::uint32_t i = 0; i < surface_.size(); ++i) {
        if (surface_.area_mm2[i] <= 0.0 || (centre_of(i) - at).norm() > 1.5 * cell_) continue;
        sum += surface_.area_mm2[i] * centre_of(i);
        weight += surface_.area_mm2[i];
      }
      if (!(weight > 0.0)) break;
      const Vector3d moved = sum / weight;
      const bool is_still = (moved - at).norm() < 1e-3 * cell_;
      at = moved;
      if (is_still) break;
    }
    return at;
  }

  const MeasuredSurface& surface_;
  double radius_, cell_;
  std::map<Cell, Vote> cells_;
};

/// Region and fit in turn, until the fit stays.
Result<FoundSphere> settle(const MeasuredSurface& surface, const SphereOptions& options, Vector3d centre) {
  const double radius = 0.5 * options.diameter_mm;
  const double band = options.band_share * options.diameter_mm + 6.0 * surface.sigma_median_mm;
  const double min_cosine = std::cos(to_radians(options.max_normal_deg));
  FoundSphere found;
  for (int round = 0; round < kMaxRounds; ++round) {
    const auto is_near = [&](std::uint32_t i) {
      const Vector3d away = surface.points[i] - centre;
      const double distance = away.norm();
      return std::abs(distance - radius) <= band && surface.normals[i].dot(away) >= min_cosine * distance;
    };
    found.region = connected_region(surface, is_near, kRimEdges * surface.spacing_mm);
    found.seen_share = found.region.area_mm2 / (std::numbers::pi * options.diameter_mm * options.diameter_mm);
    auto fit = fit_sphere(surface, found.region.points);
    if (!fit) return pass_on(fit);
    const bool is_still = (fit->centre - centre).norm() < 1e-4 * radius;
    centre = fit->centre;
    found.fit = std::move(*fit);
    if (is_still) break;
  }
  set_errors(surface, found.fit);
  return found;
}

/// Why it is not one of the wanted spheres; nothing: it is.
std::optional<Error> objection(const MeasuredSurface& surface, const SphereOptions& options, const FoundSphere& found) {
  const double diameter = 2.0 * found.fit.radius_mm;
  const double may_differ = options.max_diameter_share * options.diameter_mm + 6.0 * surface.sigma_median_mm;
  const bool is_seen = found.seen_share >= options.min_seen_share;
  if (is_seen && std::abs(diameter - options.diameter_mm) > may_differ) {
    return Error{ErrorCode::not_found,
                 fmt::format("no sphere of {:.3f} mm: the nearest one has {:.3f} mm; check --diameter",
                             options.diameter_mm, diameter)};
  }
  if (!is_seen) {
    return Error{ErrorCode::degenerate,
                 fmt::format("only {:.0f} % of the sphere of {:.3f} mm is measured, {:.0f} % are needed; put it where "
                             "both cameras see it from all sides",
                             100.0 * found.seen_share, options.diameter_mm, 100.0 * options.min_seen_share)};
  }
  return std::nullopt;
}

}  // namespace

Result<std::vector<FoundSphere>> find_spheres(const MeasuredSurface& surface, const SphereOptions& options) {
  const Votes votes(surface, 0.5 * options.diameter_mm);
  std::vector<FoundSphere> all;
  std::vector<Vector3d> taken;
  while (all.size() < options.count) {
    const auto centre = votes.best(taken);
    const auto none = [&] {
      return fail(ErrorCode::not_found, "no {}sphere of {:.3f} mm is among the measured surface; check --diameter",
                  all.empty() ? "" : "second ", options.diameter_mm);
    };
    if (!centre) return none();
    auto found = settle(surface, options, *centre);
    // A few points are no sphere that is seen too little of.
    constexpr double kTrace = 0.05;
    if (!found || found->seen_share < kTrace) return none();
    if (auto why = objection(surface, options, *found)) return tl::unexpected(*why);
    taken.push_back(found->fit.centre);
    all.push_back(std::move(*found));
  }
  return all;
}

}  // namespace scanrig::acceptance
