#include "pipeline/acceptance/find_planes.h"

#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "core/units.h"
#include "pipeline/acceptance/find_sphere.h"

namespace scanrig::acceptance {
namespace {

using Eigen::Vector3d;

constexpr double kConeDeg = 10.0;  // normals of one face; noise turns them by a few degrees
constexpr int kMaxPlaneRounds = 20;
constexpr std::size_t kDirections = 12;

double measured_area(const MeasuredSurface& surface) {
  return std::accumulate(surface.area_mm2.begin(), surface.area_mm2.end(), 0.0);
}

/// Sums of the normals of surface that looks nearly the same way, by area.
class NormalCells {
 public:
  /// `cells`: across the unit cube's half.
  NormalCells(const MeasuredSurface& surface, double cells) {
    for (std::uint32_t i = 0; i < surface.size(); ++i) {
      if (surface.area_mm2[i] <= 0.0) continue;
      const Vector3d n = cells * surface.normals[i];
      const std::array cell{static_cast<int>(std::lround(n.x())), static_cast<int>(std::lround(n.y())),
                            static_cast<int>(std::lround(n.z()))};
      sums_.try_emplace(cell, Vector3d::Zero()).first->second += surface.area_mm2[i] * surface.normals[i];
    }
  }

  /// Most area first.
  [[nodiscard]] std::vector<Vector3d> by_area() const {
    std::vector<Vector3d> order;
    for (const auto& [cell, sum] : sums_) order.push_back(sum);
    std::ranges::stable_sort(order, std::greater<>(), [](const Vector3d& sum) { return sum.norm(); });
    return order;
  }

  /// Mean of the normals in the cone around `direction`, moved until it stays.
  [[nodiscard]] Vector3d settled(Vector3d direction) const {
    const double min_cosine = std::cos(to_radians(kConeDeg));
    for (int round = 0; round < kMaxPlaneRounds; ++round) {
      Vector3d mean = Vector3d::Zero();
      for (const auto& [cell, sum] : sums_) {
        if (sum.dot(direction) >= min_cosine * sum.norm()) mean += sum;
      }
      if (!(mean.norm() > 0.0)) break;
      const bool is_still = (mean.normalized() - direction).norm() < 1e-5;
      direction = mean.normalized();
      if (is_still) break;
    }
    return direction;
  }

 private:
  std::map<std::array<int, 3>, Vector3d> sums_;
};

/// Directions in which most of the surface looks, most area first, each at least 3 cones from the others.
std::vector<Vector3d> main_directions(const MeasuredSurface& surface) {
  // Cells about a cone wide, and a quarter of it.
  constexpr double kCells = 6.0, kFineCells = 24.0;
  const NormalCells seeds(surface, kCells), fine(surface, kFineCells);
  std::vector<Vector3d> found;
  const auto is_known = [&](const Vector3d& direction) {
    const double min_cosine = std::cos(to_radians(3.0 * kConeDeg));
    return std::ranges::any_of(found, [&](const Vector3d& other) { return other.dot(direction) > min_cosine; });
  };
  for (const Vector3d& seed : seeds.by_area()) {
    if (is_known(seed.normalized())) continue;
    const Vector3d direction = fine.settled(seed.normalized());
    if (!is_known(direction)) found.push_back(direction);
    if (found.size() == kDirections) break;
  }
  return found;
}

/// Surface at nearly one offset.
struct Bin {
  double area = 0.0, sum = 0.0;  ///< of the offsets, by area
};

struct Peak {
  double offset_mm = 0.0, area_mm2 = 0.0;
};

/// Offsets along `normal` at which surface looks that way, largest area first; two are at least 2 bins apart.
std::vector<Peak> offset_peaks(const MeasuredSurface& surface, const Vector3d& normal, double bin_mm) {
  const double min_cosine = std::cos(to_radians(kConeDeg));
  std::map<long, Bin> bins;
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    if (surface.normals[i].dot(normal) < min_cosine) continue;
    const double offset = normal.dot(surface.points[i]);
    Bin& bin = bins[std::lround(offset / bin_mm)];
    bin.area += surface.area_mm2[i];
    bin.sum += surface.area_mm2[i] * offset;
  }
  const auto at = [&](long bin) {
    const auto found = bins.find(bin);
    return found == bins.end() ? 0.0 : found->second.area;
  };
  std::vector<Peak> peaks;
  for (const auto& [number, bin] : bins) {
    const double below = at(number - 1), above = at(number + 1);
    if (bin.area < below || bin.area <= above || !(bin.area > 0.0)) continue;
    peaks.push_back({bin.sum / bin.area, below + bin.area + above});
  }
  std::ranges::sort(peaks, [](const Peak& a, const Peak& b) { return a.area_mm2 > b.area_mm2; });
  return peaks;
}

/// Mean offset of the surface that looks along `normal` within half a bin of `offset_mm`, moved until it stays: a face
/// may lie in two bins.
double settled(const MeasuredSurface& surface, const Vector3d& normal, double offset_mm, double bin_mm) {
  const double min_cosine = std::cos(to_radians(kConeDeg));
  for (int round = 0; round < kMaxPlaneRounds; ++round) {
    double sum = 0.0, area = 0.0;
    for (std::uint32_t i = 0; i < surface.size(); ++i) {
      if (surface.area_mm2[i] <= 0.0 || surface.normals[i].dot(normal) < min_cosine) continue;
      const double at = normal.dot(surface.points[i]);
      if (std::abs(at - offset_mm) > 0.5 * bin_mm) continue;
      sum += surface.area_mm2[i] * at;
      area += surface.area_mm2[i];
    }
    if (!(area > 0.0)) break;
    const bool is_still = std::abs(sum / area - offset_mm) < 1e-3 * bin_mm;
    offset_mm = sum / area;
    if (is_still) break;
  }
  return offset_mm;
}

/// Regions of the planes at `offsets` and their fit, in turn, until the fit stays.
Result<FoundPlanes> settle(const MeasuredSurface& surface, const PlaneOptions& options, Vector3d normal,
                           std::vector<Peak> planes) {
  const double min_cosine = std::cos(to_radians(options.max_normal_deg));
  FoundPlanes found;
  for (int round = 0; round < kMaxPlaneRounds; ++round) {
    found.regions.clear();
    std::vector<std::vector<std::uint32_t>> points;
    for (const Peak& plane : planes) {
      const double band = options.band_share * std::sqrt(plane.area_mm2) + 6.0 * surface.sigma_median_mm;
      const auto is_near = [&](std::uint32_t i) {
        return std::abs(normal.dot(surface.points[i]) - plane.offset_mm) <= band &&
               surface.normals[i].dot(normal) >= min_cosine;
      };
      found.regions.push_back(connected_region(surface, is_near, kRimEdges * surface.spacing_mm));
      points.push_back(found.regions.back().points);
    }
    auto fit = fit_planes(surface, points, normal);
    if (!fit) return pass_on(fit);
    double moved = (fit->normal - normal).norm() * std::sqrt(planes.front().area_mm2);
    for (std::size_t k = 0; k < planes.size(); ++k) {
      moved = std::max(moved, std::abs(fit->planes[k].offset_mm - planes[k].offset_mm));
      planes[k] = {fit->planes[k].offset_mm, std::max(planes[k].area_mm2, found.regions[k].area_mm2)};
    }
    normal = fit->normal;
    found.fit = std::move(*fit);
    if (moved < 1e-4) break;
  }
  set_errors(surface, found.fit);
  return found;
}

/// The peaks at the heights over one of them, that one first; empty: there are none.
std::vector<Peak> matched(const std::vector<Peak>& peaks, const std::vector<double>& heights_mm, double tolerance_mm) {
  std::vector<Peak> best;
  double most = 0.0;
  for (const Peak& lowest : peaks) {
    std::vector<Peak> set{lowest};
    double area = lowest.area_mm2;
    for (const double height : heights_mm) {
      const auto fits = [&](const Peak& peak) {
        return std::abs(peak.offset_mm - lowest.offset_mm - height) <= tolerance_mm;
      };
      const auto peak = std::ranges::find_if(peaks, fits);  // the largest first
      if (peak == peaks.end()) break;
      set.push_back(*peak);
      area += peak->area_mm2;
    }
    if (set.size() != heights_mm.size() + 1 || area <= most) continue;
    most = area;
    best = std::move(set);
  }
  return best;
}

}  // namespace

Result<FoundPlanes> find_plane(const MeasuredSurface& surface, const PlaneOptions& options) {
  const double enough = options.min_area_share * measured_area(surface);
  std::optional<Peak> best;
  Vector3d normal;
  for (const Vector3d& direction : main_directions(surface)) {
    const auto peaks = offset_peaks(surface, direction, kRimEdges * surface.spacing_mm);
    if (peaks.empty() || peaks.front().area_mm2 < std::max(enough, best ? best->area_mm2 : 0.0)) continue;
    best = peaks.front();
    normal = direction;
  }
  const auto none =
      fail(ErrorCode::not_found, "no flat face is among the measured surface; turn it to the cameras, and scan again");
  if (!best) return none;
  best->offset_mm = settled(surface, normal, best->offset_mm, kRimEdges * surface.spacing_mm);
  auto found = settle(surface, options, normal, {*best});
  if (!found || found->regions.front().area_mm2 < enough) return none;
  return found;
}

Result<FoundPlanes> find_steps(const MeasuredSurface& surface, const std::vector<double>& heights_mm,
                               const PlaneOptions& options) {
  double gap = heights_mm.front();
  for (std::size_t k = 1; k < heights_mm.size(); ++k) gap = std::min(gap, heights_mm[k] - heights_mm[k - 1]);
  const double enough = options.min_area_share / static_cast<double>(heights_mm.size() + 1) * measured_area(surface);
  std::vector<Peak> best;
  Vector3d normal;
  double most = 0.0;
  for (const Vector3d& direction : main_directions(surface)) {
    auto peaks = offset_peaks(surface, direction, 0.1 * gap);
    std::erase_if(peaks, [&](const Peak& peak) { return peak.area_mm2 < enough; });
    for (Peak& peak : peaks) peak.offset_mm = settled(surface, direction, peak.offset_mm, 0.1 * gap);
    const auto set = matched(peaks, heights_mm, 0.25 * gap);
    double area = 0.0;
    for (const Peak& peak : set) area += peak.area_mm2;
    if (area <= most) continue;
    most = area;
    best = set;
    normal = direction;
  }
  const auto none = [&] {
    return fail(ErrorCode::not_found,
                "no parallel faces at heights of {:.3f} mm are among the measured surface; check --heights, or turn "
                "the steps to the cameras and scan again",
                fmt::join(heights_mm, ", "));
  };
  if (best.empty()) return none();
  auto found = settle(surface, options, normal, best);
  return found ? std::move(found) : none();
}

}  // namespace scanrig::acceptance
