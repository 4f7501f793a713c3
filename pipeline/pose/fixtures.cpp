#include "pipeline/pose/fixtures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "core/parallel_blocks.h"

namespace scanrig {
namespace {

constexpr double kContradictionWeight = 2.0;
constexpr double kWholeContradicted = 0.5;     ///< share of what was judged, while fixtures are part of the surface
constexpr double kRemainsContradicted = 0.25;  ///< the same after what a sketched motion tells of them was removed
constexpr double kMaxFixtureHeight = 0.8;      ///< share of the pose's: what is higher is another object, not held
constexpr double kMaxFixtureArea = 0.4;        ///< share of the pose's surface: likewise
constexpr int kFixturePointPairMotions = 200;  ///< they are the only proposals

using CellKey = std::uint64_t;

Eigen::Vector3i cell_at(const Eigen::Vector3d& point, double cell_mm) {
  return (point / cell_mm).array().round().cast<int>();
}

CellKey cell_key(const Eigen::Vector3i& at) {
  CellKey key = 0;
  for (int axis = 0; axis < 3; ++axis) key = (key << 21) | (static_cast<CellKey>(at[axis] + (1 << 20)) & 0x1FFFFF);
  return key;
}

enum class Seen : std::uint8_t { gone, there, unknown };

/// The measured surface of one pose in cells, one point each.
class JudgedSurface {
 public:
  JudgedSurface(std::vector<SurfacePoint> points, std::vector<Seen> seen, double cell_mm)
      : points_(std::move(points)), seen_(std::move(seen)), cell_mm_(cell_mm) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      at_.push_back(cell_at(points_[i].point, cell_mm));
      index_.emplace(cell_key(at_.back()), i);
    }
  }

  /// `body(j)`: of each cell within `reach` of cell i along the axes.
  template <class Body>
  void for_each_near(std::size_t i, int reach, const Body& body) const {
    Eigen::Vector3i d;
    for (d.z() = -reach; d.z() <= reach; ++d.z()) {
      for (d.y() = -reach; d.y() <= reach; ++d.y()) {
        for (d.x() = -reach; d.x() <= reach; ++d.x()) {
          const auto found = index_.find(cell_key(at_[i] + d));
          if (found != index_.end() && found->second != i) body(found->second);
        }
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] const Eigen::Vector3d& point(std::size_t i) const { return points_[i].point; }
  [[nodiscard]] Seen seen(std::size_t i) const { return seen_[i]; }
  [[nodiscard]] const Eigen::Vector3i& at(std::size_t i) const { return at_[i]; }
  [[nodiscard]] double cell_mm() const { return cell_mm_; }
  /// A plane meets this many cells per area, as its normal lies.
  [[nodiscard]] double area_mm2(std::size_t i) const {
    return cell_mm_ * cell_mm_ / points_[i].normal.cwiseAbs().sum();
  }

 private:
  std::vector<SurfacePoint> points_;
  std::vector<Seen> seen_;
  std::vector<Eigen::Vector3i> at_;
  std::unordered_map<CellKey, std::size_t> index_;
  double cell_mm_;
};

/// One other pose, and the motion into its frame.
struct OtherPose {
  PoseObservations observations;
  Transform other_from_pose;
};

Seen seen_by(std::span<const OtherPose> others, const SurfacePoint& point, double size_mm,
             const FixtureOptions& options) {
  Seen result = Seen::unknown;
  for (const OtherPose& other : others) {
    SurfacePoint carried = point;
    carried.point = other.other_from_pose * point.point;
    carried.normal = other.other_from_pose.linear() * point.normal;
    const SampleCheck check = check_sample(other.observations, 0, carried, options.reach * size_mm, options.agreement);
    if (check.kind == SampleCheck::Kind::free_space) return Seen::gone;
    const bool is_there = check.kind == SampleCheck::Kind::surface &&
                          !contradicts(check, options.spread * size_mm, options.agreement.tolerance);
    if (is_there) result = Seen::there;
  }
  return result;
}

/// The cells of gone surface that is connected from the table up, across gaps.
std::vector<std::size_t> gone_from_table(const JudgedSurface& surface, double foot_mm, const FixtureOptions& options) {
  std::vector<bool> is_reached(surface.size(), false);
  std::vector<std::size_t> all;
  for (std::size_t start = 0; start < surface.size(); ++start) {
    if (is_reached[start] || surface.seen(start) != Seen::gone) continue;
    std::vector<std::size_t> part = {start};
    is_reached[start] = true;
    double lowest = surface.point(start).y(), highest = lowest, area = 0.0;
    for (std::size_t next = 0; next < part.size(); ++next) {
      const std::size_t i = part[next];
      lowest = std::min(lowest, surface.point(i).y());
      highest = std::max(highest, surface.point(i).y());
      area += surface.area_mm2(i);
      surface.for_each_near(i, options.gap_cells, [&](std::size_t j) {
        if (is_reached[j] || surface.seen(j) != Seen::gone) return;
        is_reached[j] = true;
        part.push_back(j);
      });
    }
    if (lowest <= foot_mm && highest >= options.min_height_mm && area >= options.min_area_mm2) {
      all.insert(all.end(), part.begin(), part.end());
    }
  }
  return all;
}

/// The fixture's cells, and those of unjudged surface around them.
std::vector<std::size_t> grown(const JudgedSurface& surface, std::vector<std::size_t> fixture,
                               const FixtureOptions& options) {
  std::vector<bool> is_held(surface.size(), false);
  for (const std::size_t i : fixture) is_held[i] = true;
  std::vector<std::size_t> front = fixture;
  for (int step = 0; step < options.grown_steps; ++step) {
    std::vector<std::size_t> next;
    for (const std::size_t i : front) {
      surface.for_each_near(i, 2, [&](std::size_t j) {
        if (is_held[j] || surface.seen(j) != Seen::unknown) return;
        is_held[j] = true;
        next.push_back(j);
      });
    }
    fixture.insert(fixture.end(), next.begin(), next.end());
    front = std::move(next);
  }
  return fixture;
}

Fixture fixture_of(const JudgedSurface& surface, std::span<const std::size_t> gone, const FixtureOptions& options) {
  Fixture fixture{.cell_mm = surface.cell_mm()};
  for (const std::size_t i : gone) fixture.height_mm = std::max(fixture.height_mm, surface.point(i).y());
  for (const std::size_t i : grown(surface, {gone.begin(), gone.end()}, options)) {
    const double area = surface.area_mm2(i);
    fixture.area_mm2 += area;
    fixture.centre += area * surface.point(i);
    Eigen::Vector3i d;
    for (d.z() = -1; d.z() <= 1; ++d.z()) {
      for (d.y() = -1; d.y() <= 1; ++d.y()) {
        for (d.x() = -1; d.x() <= 1; ++d.x()) fixture.cells.push_back(cell_key(surface.at(i) + d));
      }
    }
  }
  fixture.centre /= fixture.area_mm2;
  std::ranges::sort(fixture.cells);
  fixture.cells.erase(std::unique(fixture.cells.begin(), fixture.cells.end()), fixture.cells.end());
  return fixture;
}

/// Two different objects, one laid over the other, contradict from the table up too.
bool can_be_one(const Fixture& fixture, const JudgedSurface& surface) {
  double top = 0.0, area = 0.0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    top = std::max(top, surface.point(i).y());
    area += surface.area_mm2(i);
  }
  return fixture.height_mm <= kMaxFixtureHeight * top && fixture.area_mm2 <= kMaxFixtureArea * area;
}

}  // namespace

bool Fixture::holds(const Eigen::Vector3d& point) const {
  return std::ranges::binary_search(cells, cell_key(cell_at(point, cell_mm)));
}

std::vector<std::optional<Fixture>> find_fixtures(std::span<const PlacedPose> poses, const FixtureOptions& options) {
  std::vector<MeasuredPose> measured(poses.size());
  double size_mm = 0.0;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    measured[p].images = range_pyramid(poses[p].views, 1);
    size_mm = std::max(size_mm, measured_size(measured[p].images[0]));
  }
  std::vector<std::optional<Fixture>> fixtures(poses.size());
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!poses[p].model_from_pose) continue;
    std::vector<OtherPose> others;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      if (k == p || !poses[k].model_from_pose) continue;
      others.push_back(
          {{&measured[k], poses[k].views}, poses[k].model_from_pose->inverse() * *poses[p].model_from_pose});
    }
    auto points = sample_surface(measured[p].images[0], options.cell * size_mm);
    std::vector<Seen> seen(points.size());
    for_each_in_blocks(points.size(), [&](std::size_t i) { seen[i] = seen_by(others, points[i], size_mm, options); });
    const JudgedSurface surface(std::move(points), std::move(seen), options.cell * size_mm);
    const auto gone = gone_from_table(surface, options.foot * size_mm, options);
    if (gone.empty()) continue;
    Fixture fixture = fixture_of(surface, gone, options);
    if (can_be_one(fixture, surface)) fixtures[p] = std::move(fixture);
  }
  return fixtures;
}

std::vector<Eigen::Vector3f> remove_fixture(const Fixture& fixture, RangeImage& range) {
  std::vector<Eigen::Vector3f> removed;
  range.depth = range.depth.clone();
  range.sigma = range.sigma.clone();
  range.normal = range.normal.clone();
  const Transform pose_from_camera = range.camera_from_pose.inverse();
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      float& depth = range.depth(v, u);
      if (std::isnan(depth)) continue;
      const Eigen::Vector3d point = pose_from_camera * range.projection.unproject(u, v, depth);
      if (!fixture.holds(point)) continue;
      removed.emplace_back(point.cast<float>());
      depth = range.sigma(v, u) = kUnmeasured;
      range.normal(v, u) = cv::Vec3f::all(kUnmeasured);
    }
  }
  return removed;
}

PoseOptions options_for_fixtures(PoseOptions options, FixtureSurface surface) {
  options.stable_tangent_planes = false;
  options.point_pair_motions = std::max(options.point_pair_motions, kFixturePointPairMotions);
  options.voting.references = 500;
  options.voting.peaks = 6;
  options.rounds[0].keep = 200;
  options.rounds[1].keep = 32;
  // What is left of a fixture contradicts a right motion, and would decide a turn that little else holds.
  options.search_again_contradicted = 1.0;
  options.weak_condition = std::numeric_limits<double>::infinity();
  options.last_round.contradiction_weight = kContradictionWeight;
  if (surface == FixtureSurface::gone) return options;
  const double forgiven = surface == FixtureSurface::whole ? kWholeContradicted : kRemainsContradicted;
  options.max_contradicted = std::max(options.max_contradicted, forgiven);
  return options;
}

}  // namespace scanrig
