#include "pipeline/pose/equivalent_motions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/units.h"

namespace scanrig {
namespace {

/// Views of a pose in pose 1's frame; they share the pixels.
void add_placed(std::span<const View> views, const Transform& pose1_from_pose, std::vector<View>& all) {
  const Transform pose_from_pose1 = pose1_from_pose.inverse();
  for (const View& view : views) {
    View& placed = all.emplace_back(view);
    placed.range.camera_from_pose = placed.range.camera_from_pose * pose_from_pose1;
    for (Silhouette& s : placed.silhouettes) s.camera_from_pose = s.camera_from_pose * pose_from_pose1;
  }
}

/// Whether all motions that the symmetry makes of the best one fit as it does.
bool fits_everywhere(const Symmetry& symmetry, const Hypothesis& best, const Scene& scene, const PoseOptions& options) {
  std::vector<Transform> motions;
  for (const Transform& element : symmetry.elements) {
    motions.push_back(element * best.candidate.pose1_from_pose2);
    for (const FreeTurn& turn : symmetry.free_turns()) {
      const Eigen::Translation3d to_point(turn.point);
      for (int k = 1; k < 6; ++k) {
        const Eigen::AngleAxisd by(to_radians(60.0 * k + 11.0), turn.axis);
        motions.push_back(to_point * by * to_point.inverse() * motions.back());
      }
    }
  }
  const int level = options.symmetry.level;
  const double reach = options.symmetry.reach * scene.size_mm;
  const auto check = [&](const Transform& motion) {
    return check_samples(scene.observations1, scene.observations2, motion, level, reach, options.agreement);
  };
  const auto reference = check(best.candidate.pose1_from_pose2);
  const double spread =
      1.4826 * count_agreement(reference, std::numeric_limits<double>::infinity(), options.agreement).median_mm;
  return std::ranges::none_of(motions, [&](const Transform& motion) {
    return compare(reference, check(motion), spread, options.agreement).separable;
  });
}

/// 0: turned over so far that both poses share surface from all sides; 1: turned over; 2: not.
int turned_over_rank(const Transform& motion, const PoseOptions& options) {
  const double tilt = tilt_deg(motion);
  if (tilt > options.min_turned_over_deg && tilt < 180.0 - options.min_turned_over_deg) return 0;
  return tilt < options.same_rest_tilt_deg ? 2 : 1;
}

/// Motions that the symmetry makes of one: all of a finite group, some turns of the others.
std::vector<Transform> equivalent_motions(const Symmetry& symmetry, const Transform& motion) {
  std::vector<Transform> motions;
  for (const Transform& element : symmetry.elements) {
    motions.push_back(element * motion);
    const std::size_t last = motions.size() - 1;
    for (const FreeTurn& turn : symmetry.free_turns()) {
      const Eigen::Translation3d to_point(turn.point);
      for (int k = 1; k < 12; ++k) {
        const Eigen::AngleAxisd by(to_radians(30.0 * k), turn.axis);
        motions.push_back(to_point * by * to_point.inverse() * motions[last]);
      }
    }
  }
  return motions;
}

/// Samples of one pose as a motion carries them into the frame of another, that hide from it: on its table, where what
/// holds a turn end for end leaves the height open by `reach`; or on a side, not higher than that above the lowest that
/// it measured.
class Hidden {
 public:
  Hidden(const std::vector<SurfacePoint>& samples, const std::vector<SurfacePoint>& others, double reach, double flat)
      : samples_(samples),
        lowest_(std::min(lowest(others, Transform::Identity()), 2.0 * reach)),
        reach_(reach),
        flat_(flat) {}

  /// A flag per sample.
  [[nodiscard]] std::vector<char> after(const Transform& motion) const {
    const double table = std::clamp(lowest(samples_, motion), 0.0, reach_);
    std::vector<char> hidden;
    for (const SurfacePoint& sample : samples_) {
      const double height = (motion * sample.point).y();
      const bool is_side = std::abs((motion.linear() * sample.normal).y()) < kSideSlope;
      hidden.push_back(height < table + flat_ || (is_side && height < lowest_ + reach_) ? 1 : 0);
    }
    return hidden;
  }

 private:
  static constexpr double kSideSlope = 0.7;

  static double lowest(const std::vector<SurfacePoint>& samples, const Transform& motion) {
    double low = std::numeric_limits<double>::infinity();
    for (const SurfacePoint& sample : samples) low = std::min(low, (motion * sample.point).y());
    return low;
  }

  const std::vector<SurfacePoint>& samples_;
  double lowest_, reach_, flat_;
};

}  // namespace

std::optional<Symmetry> symmetry_of(const Hypothesis& best, std::span<const Candidate* const> rivals,
                                    const PoseInput& pose1, const PoseInput& pose2, const Scene& scene,
                                    const PoseOptions& options) {
  const Transform& motion = best.candidate.pose1_from_pose2;
  std::vector<Transform> residuals;
  for (const Candidate* rival : rivals) residuals.push_back(motion * rival->pose1_from_pose2.inverse());
  const SymmetryOptions& limits = options.symmetry;
  const auto checks = check_samples(scene.observations1, scene.observations2, motion, limits.level,
                                    limits.reach * scene.size_mm, options.agreement);
  const double spread =
      1.4826 * count_agreement(checks, std::numeric_limits<double>::infinity(), options.agreement).median_mm;
  const Patches patches =
      make_patches(scene.measured1, scene.measured2, limits.level, limits.patches.cell * scene.size_mm);
  const double of_patches = patch_spread(patches, checks, limits.patches);
  for (const Symmetry::Of of : {Symmetry::Of::both_poses, Symmetry::Of::pose2, Symmetry::Of::pose1}) {
    std::vector<View> views;
    if (of != Symmetry::Of::pose2) add_placed(pose1.views, Transform::Identity(), views);
    if (of != Symmetry::Of::pose1) add_placed(pose2.views, motion, views);
    const SelfComparison surface(std::move(views), limits.level + 1, spread, of_patches, options.agreement, limits);
    auto symmetry = find_symmetry(surface, residuals, limits);
    if (!symmetry) continue;
    symmetry->of = of;
    if (of != Symmetry::Of::both_poses && !fits_everywhere(*symmetry, best, scene, options)) continue;
    return symmetry;
  }
  return std::nullopt;
}

bool may_be_turned_over(const Transform& not_turned, const Symmetry& symmetry, const Scene& scene,
                        const PoseOptions& options) {
  const int level = std::min(options.symmetry.level + 1, options.levels - 1);
  const double reach = options.symmetry.reach * scene.size_mm, flat = options.flat_share * scene.size_mm;
  const auto check = [&](const Transform& motion) {
    return check_samples(scene.observations1, scene.observations2, motion, level, reach, options.agreement);
  };
  const auto& samples2 = scene.measured2.samples[static_cast<std::size_t>(level)];
  const auto& samples1 = scene.measured1.samples[static_cast<std::size_t>(level)];
  const Hidden of_pose2(samples2, samples1, reach, flat), of_pose1(samples1, samples2, reach, flat);
  const auto reference = check(not_turned);
  std::vector<char> is_explained(reference.size(), 0);
  bool is_possible = false;
  for (const Transform& motion : equivalent_motions(symmetry, not_turned)) {
    if (!turns_over(motion, options)) continue;
    is_possible = true;
    const auto checks = check(motion);
    const auto hidden2 = of_pose2.after(motion), hidden1 = of_pose1.after(motion.inverse());
    for (std::size_t i = 0; i < checks.size(); ++i) {
      const bool is_hidden = i < samples2.size() ? hidden2[i] != 0 : hidden1[i - samples2.size()] != 0;
      if (is_hidden || checks[i].kind != SampleCheck::Kind::unknown) is_explained[i] = 1;
    }
  }
  std::size_t unexplained = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    unexplained += reference[i].kind == SampleCheck::Kind::surface && is_explained[i] == 0 ? 1 : 0;
  }
  return is_possible &&
         static_cast<double>(unexplained) <= options.max_unexplained * static_cast<double>(reference.size());
}

void prefer_turned_over(std::vector<Hypothesis>& field, const Symmetry& symmetry, const Scene& scene,
                        const PoseOptions& options) {
  const auto rank_of = [&](const Hypothesis& h) { return turned_over_rank(h.candidate.pose1_from_pose2, options); };
  std::vector<Hypothesis> made;
  for (const Transform& motion : equivalent_motions(symmetry, field[0].candidate.pose1_from_pose2)) {
    Hypothesis& h = made.emplace_back();
    h.candidate.pose1_from_pose2 = motion;
    h.candidate.generator = "symmetry";
  }
  std::ranges::stable_sort(made, {}, rank_of);
  if (rank_of(made.front()) >= rank_of(field[0])) return;
  std::size_t first = 1;
  while (first < field.size() && !(is_rival(field[first].candidate, field[0].candidate, options) &&
                                   rank_of(field[first]) <= rank_of(made.front()))) {
    ++first;
  }
  if (first == field.size()) {
    made.resize(1);
    SearchRound round = options.last_round;
    round.keep = 1;
    narrow(made, scene, options, round);
    field.push_back(std::move(made.front()));
    std::vector<Hypothesis> both;
    both.push_back(field[0]);
    both.push_back(field.back());
    judge(both, options);
    const bool is_worse = both[1].candidate.generator == "symmetry" && both[1].candidate.separable;
    for (const Hypothesis& h : both) {
      if (h.candidate.generator == "symmetry") field.back() = h;
    }
    if (is_worse) return;
  }
  std::rotate(field.begin(), field.begin() + static_cast<std::ptrdiff_t>(first),
              field.begin() + static_cast<std::ptrdiff_t>(first) + 1);
  for (Hypothesis& h : field) h.candidate.angle_to_best_deg = apart_deg(h.candidate, field[0].candidate);
}

}  // namespace scanrig
