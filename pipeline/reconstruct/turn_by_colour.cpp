#include "pipeline/reconstruct/turn_by_colour.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "core/parallel.h"
#include "core/parallel_blocks.h"
#include "core/units.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/texture/photo_view.h"
#include "pipeline/texture/point_colour.h"

namespace scanrig {
namespace {

using CellKey = std::array<int, 3>;

/// Paint averaged over a cube.
struct PaintCell {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d tone = Eigen::Vector3d::Zero();  ///< BGR, logarithm of the paint, its trend taken out
  double count = 0.0;
};

CellKey key_of(const Eigen::Vector3d& p, double width) {
  return {static_cast<int>(std::floor(p.x() / width)), static_cast<int>(std::floor(p.y() / width)),
          static_cast<int>(std::floor(p.z() / width))};
}

/// The paint of one pose, on cubes.
class PaintGrid {
 public:
  PaintGrid(std::span<const PaintedPoint> points, std::span<const Eigen::Vector3d> tones, double width)
      : width_(width) {
    std::map<CellKey, std::size_t> known;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto [it, fresh] = known.try_emplace(key_of(points[i].point, width), cells_.size());
      if (fresh) cells_.emplace_back();
      PaintCell& cell = cells_[it->second];
      cell.point += points[i].point;
      cell.tone += tones[i];
      cell.count += 1.0;
    }
    for (PaintCell& cell : cells_) {
      cell.point /= cell.count;
      cell.tone /= cell.count;
    }
    keys_.assign(known.begin(), known.end());
  }

  [[nodiscard]] const std::vector<PaintCell>& cells() const { return cells_; }

  /// Mean of the cells around `p`, the nearer the heavier; nothing where none is within a cell's width.
  [[nodiscard]] std::optional<Eigen::Vector3d> at(const Eigen::Vector3d& p) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0.0;
    const CellKey low = key_of(p - Eigen::Vector3d::Constant(0.5 * width_), width_);
    for (int k = 0; k < 8; ++k) {
      const CellKey key{low[0] + (k & 1), low[1] + ((k >> 1) & 1), low[2] + (k >> 2)};
      const auto it = std::ranges::lower_bound(keys_, key, {}, &std::pair<CellKey, std::size_t>::first);
      if (it == keys_.end() || it->first != key) continue;
      const PaintCell& cell = cells_[it->second];
      const double w = 1.0 - (cell.point - p).norm() / width_;
      if (w <= 0.0) continue;
      sum += w * cell.tone;
      weight += w;
    }
    if (weight < 0.1) return std::nullopt;
    return sum / weight;
  }

 private:
  double width_;
  std::vector<PaintCell> cells_;
  std::vector<std::pair<CellKey, std::size_t>> keys_;  ///< sorted
};

/// Logarithms of the paint less what varies with height and slope alone: light that one pose cannot tell from paint.
std::vector<Eigen::Vector3d> tones_of(std::span<const PaintedPoint> points, double size_mm, float darkest) {
  std::vector<Eigen::Vector3d> tones;
  Eigen::Matrix4d normal = 1e-6 * Eigen::Matrix4d::Identity();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  const auto terms = [&](const PaintedPoint& p) {
    return Eigen::Vector4d(1.0, p.point.y() / size_mm, p.normal.y(), p.normal.y() * p.normal.y());
  };
  for (const PaintedPoint& p : points) {
    tones.emplace_back(p.bgr.cwiseMax(darkest).array().log().matrix().cast<double>());
    normal += terms(p) * terms(p).transpose();
    right += terms(p) * tones.back().transpose();
  }
  const Eigen::Matrix<double, 4, 3> trend = normal.ldlt().solve(right);
  for (std::size_t i = 0; i < points.size(); ++i) tones[i] -= trend.transpose() * terms(points[i]);
  return tones;
}

double size_of(std::span<const PaintedPoint> points) {
  Eigen::AlignedBox3d box;
  for (const PaintedPoint& p : points) box.extend(p.point);
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

/// Paint of both poses at one place.
struct Match {
  std::size_t cell;
  Eigen::Vector3d tone1, tone2;
};

std::vector<Match> matches_of(const PaintGrid& pose1, const PaintGrid& pose2, const Transform& pose1_from_pose2) {
  const Transform pose2_from_pose1 = pose1_from_pose2.inverse();
  std::vector<Match> matches;
  for (std::size_t i = 0; i < pose1.cells().size(); ++i) {
    const PaintCell& cell = pose1.cells()[i];
    if (const auto tone = pose2.at(pose2_from_pose1 * cell.point)) matches.push_back({i, cell.tone, *tone});
  }
  return matches;
}

/// Takes each pose's mean out and brings both to unit variance, all channels together.
double standardise(std::vector<Match>& matches) {
  Eigen::Vector3d mean1 = Eigen::Vector3d::Zero(), mean2 = Eigen::Vector3d::Zero();
  for (const Match& m : matches) {
    mean1 += m.tone1;
    mean2 += m.tone2;
  }
  const double count = static_cast<double>(std::max<std::size_t>(matches.size(), 1));
  double power1 = 1e-12, power2 = 1e-12, shared = 0.0;
  for (Match& m : matches) {
    m.tone1 -= mean1 / count;
    m.tone2 -= mean2 / count;
    power1 += m.tone1.squaredNorm();
    power2 += m.tone2.squaredNorm();
    shared += m.tone1.dot(m.tone2);
  }
  for (Match& m : matches) {
    m.tone1 /= std::sqrt(power1 / count);
    m.tone2 /= std::sqrt(power2 / count);
  }
  return shared / std::sqrt(power1 * power2);
}

struct Scored {
  Transform motion = Transform::Identity();
  double correlation = -1.0;
  std::size_t shared = 0;
};

Scored score(const PaintGrid& pose1, const PaintGrid& pose2, const Transform& motion) {
  auto matches = matches_of(pose1, pose2, motion);
  const std::size_t shared = matches.size();
  return {motion, shared > 0 ? standardise(matches) : -1.0, shared};
}

Transform turned(const FreeTurn& turn, double angle, const Transform& motion) {
  const Eigen::Translation3d to_point(turn.point);
  return to_point * Eigen::AngleAxisd(angle, turn.axis) * to_point.inverse() * motion;
}

/// The motions to try: as given, all around an axis, or over all turns of a ball.
std::vector<Transform> search_grid(std::span<const Transform> motions, std::span<const FreeTurn> free,
                                   const ColourOptions& options) {
  std::vector<Transform> grid;
  for (const Transform& motion : motions) {
    if (free.empty()) grid.push_back(motion);
    if (free.size() == 1) {
      const int steps = static_cast<int>(std::lround(360.0 / options.coarse_step_deg));
      for (int k = 0; k < steps; ++k) grid.push_back(turned(free[0], to_radians(360.0 * k / steps), motion));
    }
    if (free.size() < 3) continue;
    const int steps = static_cast<int>(std::lround(180.0 / options.ball_step_deg));
    for (int tilt = 0; tilt <= steps; ++tilt) {
      const double from_pole = std::numbers::pi * tilt / steps;
      const int around = std::max(1, static_cast<int>(std::lround(2.0 * steps * std::sin(from_pole))));
      for (int a = 0; a < around; ++a) {
        for (int b = 0; b < 2 * steps; ++b) {
          const Transform spun = turned(free[1], std::numbers::pi * b / steps, motion);
          const Transform tilted = turned(free[0], from_pole, spun);
          grid.push_back(turned(free[1], 2.0 * std::numbers::pi * a / around, tilted));
        }
      }
    }
  }
  return grid;
}

std::vector<Scored> score_all(const PaintGrid& pose1, const PaintGrid& pose2, const std::vector<Transform>& grid) {
  std::vector<Scored> scored(grid.size());
  parallel_for(grid.size(), [&](std::size_t i) { scored[i] = score(pose1, pose2, grid[i]); });
  return scored;
}

double degrees_apart(const Transform& a, const Transform& b) {
  return to_degrees(rotation_angle(a.linear().transpose() * b.linear()));
}

/// The best distinct motions, best first; what shares too little surface is left out.
std::vector<Scored> best_distinct(std::vector<Scored> scored, std::size_t count, const ColourOptions& options) {
  std::size_t widest = 0;
  for (const Scored& s : scored) widest = std::max(widest, s.shared);
  std::ranges::stable_sort(scored, std::greater(), &Scored::correlation);
  std::vector<Scored> best;
  for (const Scored& s : scored) {
    if (best.size() == count) break;
    if (static_cast<double>(s.shared) < options.min_shared * static_cast<double>(widest)) continue;
    const bool is_known = std::ranges::any_of(
        best, [&](const Scored& known) { return degrees_apart(known.motion, s.motion) < options.apart_deg; });
    if (!is_known) best.push_back(s);
  }
  return best;
}

/// Climbs along the free turns with ever smaller steps.
Scored climb(const PaintGrid& pose1, const PaintGrid& pose2, Scored best, std::span<const FreeTurn> free,
             double step_deg, const ColourOptions& options) {
  best = score(pose1, pose2, best.motion);
  for (double step = step_deg; !free.empty() && step >= options.finest_step_deg; step *= 0.5) {
    for (bool is_better = true; is_better;) {
      is_better = false;
      for (const FreeTurn& turn : free) {
        for (const double sign : {-1.0, 1.0}) {
          const Scored next = score(pose1, pose2, turned(turn, sign * to_radians(step), best.motion));
          if (next.correlation <= best.correlation) continue;
          best = next;
          is_better = true;
        }
      }
    }
  }
  return best;
}

/// Squared differences of the paint, by cell of pose 1.
std::map<std::size_t, double> differences_of(const PaintGrid& pose1, const PaintGrid& pose2, const Transform& motion) {
  auto matches = matches_of(pose1, pose2, motion);
  standardise(matches);
  std::map<std::size_t, double> result;
  for (const Match& m : matches) result[m.cell] = std::min((m.tone1 - m.tone2).squaredNorm(), 8.0);
  return result;
}

/// By how many standard deviations `best` agrees better than `other`, each patch of the surface as one vote.
double confidence_of(const PaintGrid& pose1, const PaintGrid& pose2, const Transform& best, const Transform& other,
                     double patch_mm) {
  const auto of_best = differences_of(pose1, pose2, best);
  const auto of_other = differences_of(pose1, pose2, other);
  std::map<CellKey, std::pair<double, int>> patches;
  for (const auto& [cell, difference] : of_best) {
    const auto it = of_other.find(cell);
    if (it == of_other.end()) continue;
    auto& [sum, count] = patches[key_of(pose1.cells()[cell].point, patch_mm)];
    sum += it->second - difference;
    ++count;
  }
  if (patches.size() < 4) return 0.0;
  double sum = 0.0, squares = 0.0;
  for (const auto& [key, patch] : patches) {
    const double mean = patch.first / patch.second;
    sum += mean;
    squares += mean * mean;
  }
  const double n = static_cast<double>(patches.size()), mean = sum / n;
  const double variance = std::max((squares - n * mean * mean) / (n - 1.0), 1e-9);
  return mean / std::sqrt(variance / n);
}

double contrast_of(const PaintGrid& pose1, const PaintGrid& pose2, const Transform& motion) {
  const auto matches = matches_of(pose1, pose2, motion);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Match& m : matches) mean += m.tone1;
  const double count = static_cast<double>(std::max<std::size_t>(matches.size(), 1));
  double power = 0.0;
  for (const Match& m : matches) power += (m.tone1 - mean / count).squaredNorm();
  return std::sqrt(power / (3.0 * count));
}

}  // namespace

Result<std::vector<PaintedPoint>> paint_of(const Mesh& partial, std::span<const Photo> photos, const Context& context) {
  if (photos.empty()) return std::vector<PaintedPoint>{};
  Mesh mesh = partial;
  if (mesh.normals.size() != mesh.vertices.size()) mesh.normals = vertex_normals(mesh);
  const TextureOptions options;
  const double px_per_mm = typical_px_per_mm(mesh, photos);
  std::vector<std::optional<PhotoView>> made(photos.size());
  parallel_for(made.size(), [&](std::size_t p) {
    if (!context.stopped()) made[p].emplace(photos[p], mesh, options, px_per_mm);
  });
  if (context.stopped()) return fail(ErrorCode::stopped, "colours of a pose: stopped");
  std::vector<PhotoView> views;
  for (auto& view : made) views.push_back(std::move(*view));
  const RigLight light = light_from_photos(views, mesh, mesh.normals, options.blending);
  std::vector<PointColour> colours(mesh.vertices.size());
  for_each_in_blocks(colours.size(), [&](std::size_t v) {
    if (mesh.views.size() == colours.size() && mesh.views[v] == 0) return;
    colours[v] =
        blend_photos(views, light, mesh.vertices[v].cast<double>(), mesh.normals[v].cast<double>(), options.blending);
  });
  std::vector<PaintedPoint> points;
  for (std::size_t v = 0; v < colours.size(); ++v) {
    if (colours[v].weight <= 0.0F) continue;
    points.push_back({mesh.vertices[v].cast<double>(), mesh.normals[v].cast<double>(), colours[v].bgr});
  }
  return points;
}

ColourDecision turn_by_colour(std::span<const PaintedPoint> pose1, std::span<const PaintedPoint> pose2,
                              std::span<const Transform> motions, std::span<const FreeTurn> free,
                              const ColourOptions& options) {
  ColourDecision decision;
  if (!motions.empty()) decision.pose1_from_pose2 = motions.front();
  const double size = 0.5 * (size_of(pose1) + size_of(pose2));
  if (motions.empty() || pose1.empty() || pose2.empty() || !(size > 0.0)) return decision;
  const auto tones1 = tones_of(pose1, size, options.darkest);
  const auto tones2 = tones_of(pose2, size, options.darkest);
  const PaintGrid coarse1(pose1, tones1, options.coarse_cell * size),
      coarse2(pose2, tones2, options.coarse_cell * size);
  const PaintGrid fine1(pose1, tones1, options.cell * size), fine2(pose2, tones2, options.cell * size);
  const double step = free.size() == 3 ? options.ball_step_deg : options.coarse_step_deg;

  constexpr std::size_t kClimbed = 6;
  const auto starts =
      best_distinct(score_all(coarse1, coarse2, search_grid(motions, free, options)), kClimbed, options);
  std::vector<Scored> climbed;
  for (const Scored& start : starts) {
    const Scored near = climb(coarse1, coarse2, start, free, 0.5 * step, options);
    climbed.push_back(climb(fine1, fine2, near, free, 1.0, options));
  }
  climbed = best_distinct(std::move(climbed), kClimbed, options);
  if (climbed.empty() || climbed[0].shared < options.min_cells) return decision;
  const Scored best = climbed[0];
  // All may have climbed one hill: then another place on its slope is the best other one.
  for (const Scored& start : starts) climbed.push_back(score(fine1, fine2, start.motion));
  const auto other = std::find_if(climbed.begin() + 1, climbed.end(), [&](const Scored& s) {
    return degrees_apart(s.motion, best.motion) >= options.apart_deg;
  });
  decision.correlation = best.correlation;
  decision.contrast = contrast_of(fine1, fine2, best.motion);
  if (other != climbed.end()) {
    decision.next = other->correlation;
    decision.confidence = confidence_of(fine1, fine2, best.motion, other->motion, options.patch * size);
  }
  decision.is_decided = decision.confidence >= options.min_confidence &&
                        decision.correlation >= options.min_correlation && decision.contrast >= options.min_contrast;
  if (decision.is_decided) decision.pose1_from_pose2 = best.motion;
  return decision;
}

}  // namespace scanrig
