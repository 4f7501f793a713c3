#include "pipeline/pose/symmetry.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/units.h"

namespace scanrig {
namespace {

using Elements = std::vector<Transform>;

/// Axis and angle (0..pi) of a rotation, and the point of its axis that is nearest to `near`.
struct Turn {
  Eigen::Vector3d axis, point;
  double angle;
};

Turn rotation_about(const Transform& motion, const Eigen::Vector3d& near) {
  const Eigen::AngleAxisd rotation(motion.linear());
  const Eigen::Vector3d& a = rotation.axis();
  const Eigen::Vector3d shift = motion * near - near;
  const Eigen::Vector3d across = shift - a * a.dot(shift);
  return {a, near + 0.5 * (across + a.cross(across) / std::tan(0.5 * rotation.angle())), rotation.angle()};
}

Transform turned_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& point, double angle) {
  const Eigen::Translation3d to_point(point);
  return to_point * Eigen::AngleAxisd(angle, axis) * to_point.inverse();
}

double angle_between_lines(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

class GroupSearch {
 public:
  GroupSearch(const SelfComparison& surface, const SymmetryOptions& options) : surface_(surface), options_(options) {}

  std::optional<Symmetry> find(std::span<const Transform> motions);

 private:
  [[nodiscard]] bool is_same(const Transform& a, const Transform& b) const {
    return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(options_.same_deg);
  }
  [[nodiscard]] bool holds(const Transform& motion) const {
    return std::ranges::any_of(elements_, [&](const Transform& e) { return is_same(e, motion); });
  }
  /// Adds the motion if it is new and fits.
  bool try_motion(const Transform& motion) {
    const auto is_this = [&](const Transform& other) { return is_same(other, motion); };
    if (elements_.size() >= options_.max_elements || holds(motion) || std::ranges::any_of(rejected_, is_this)) {
      return false;
    }
    const auto found = surface_.symmetric_near(motion);
    if (!found || !is_same(*found, motion) || holds(*found)) {
      rejected_.push_back(motion);
      return false;
    }
    elements_.push_back(*found);
    return true;
  }
  void close();
  [[nodiscard]] bool is_closed() const;
  [[nodiscard]] std::vector<Turn> axes() const;
  [[nodiscard]] bool is_axial(const Turn& turn) const;
  [[nodiscard]] bool is_ball(const Turn& turn) const;
  [[nodiscard]] Symmetry continuous(const Turn& turn);
  [[nodiscard]] std::optional<Transform> end_for_end(const Turn& turn) const;
  void try_finer_turns();
  void try_perpendicular_turns();
  [[nodiscard]] int fold_of(const Eigen::Vector3d& axis) const;
  [[nodiscard]] Symmetry finite() const;
  [[nodiscard]] Eigen::Vector3d centre() const;

  const SelfComparison& surface_;
  SymmetryOptions options_;
  Elements elements_ = {Transform::Identity()};
  Elements rejected_;
};

/// Distinct axes of the elements, those of the smallest turns first.
std::vector<Turn> GroupSearch::axes() const {
  std::vector<Turn> turns;
  for (std::size_t i = 1; i < elements_.size(); ++i) turns.push_back(rotation_about(elements_[i], surface_.middle()));
  std::ranges::stable_sort(turns, {}, &Turn::angle);
  std::vector<Turn> distinct;
  for (const Turn& turn : turns) {
    const bool is_known = std::ranges::any_of(distinct, [&](const Turn& known) {
      return angle_between_lines(known.axis, turn.axis) < 2.0 * to_radians(options_.same_deg);
    });
    if (!is_known) distinct.push_back(turn);
  }
  return distinct;
}

/// Products of the elements: what is carried onto itself twice is so in one motion, too.
void GroupSearch::close() {
  const auto add = [&](const Transform& product) {
    if (elements_.size() < options_.max_elements && !holds(product)) elements_.push_back(product);
  };
  for (std::size_t i = 1; i < elements_.size(); ++i) {
    add(elements_[i].inverse());
    for (std::size_t k = 1; k <= i; ++k) {
      add(elements_[i] * elements_[k]);
      add(elements_[k] * elements_[i]);
    }
  }
}

bool GroupSearch::is_closed() const {
  return std::ranges::all_of(elements_, [&](const Transform& a) {
    return std::ranges::all_of(elements_, [&](const Transform& b) { return holds(a * b); });
  });
}

/// Turns that no finite group of `max_fold` has in common.
bool GroupSearch::is_axial(const Turn& turn) const {
  constexpr double kGolden = 137.507764;  // deg; its multiples avoid all fractions of the circle
  for (int k = 1; k <= 4; ++k) {
    const FreeTurn held{turn.axis, turn.point};
    if (!surface_.symmetric_near(turned_about(turn.axis, turn.point, to_radians(kGolden * k)), {&held, 1})) {
      return false;
    }
  }
  return true;
}

/// The turn by 180 deg about an axis across this one. Any of them will do.
std::optional<Transform> GroupSearch::end_for_end(const Turn& turn) const {
  for (std::size_t i = 1; i < elements_.size(); ++i) {
    const Eigen::Vector3d moved = elements_[i].linear() * turn.axis;
    if (moved.dot(turn.axis) < -0.9) return elements_[i];
  }
  const Eigen::Vector3d on_axis = surface_.halfway(turn.axis, turn.point);
  const FreeTurn held{turn.axis, turn.point};
  return surface_.symmetric_near(turned_about(turn.axis.unitOrthogonal(), on_axis, std::numbers::pi), {&held, 1});
}

/// Whether it turns about other axes as freely, through the point where all normals of a ball meet.
bool GroupSearch::is_ball(const Turn& turn) const {
  const Eigen::Vector3d across = turn.axis.unitOrthogonal();
  return std::ranges::all_of(std::array{across, Eigen::Vector3d((turn.axis.cross(across) + turn.axis).normalized())},
                             [&](const Eigen::Vector3d& axis) {
                               return is_axial({axis, surface_.focus(), 0.0});
                             });
}

Symmetry GroupSearch::continuous(const Turn& turn) {
  Symmetry symmetry;
  symmetry.motions = 0;
  symmetry.fold = 0;
  if (is_ball(turn)) {
    symmetry.group = Symmetry::Group::spherical;
    symmetry.point = surface_.focus();
    return symmetry;
  }
  symmetry.group = Symmetry::Group::axial;
  symmetry.axis = turn.axis.y() < 0.0 ? Eigen::Vector3d(-turn.axis) : turn.axis;
  symmetry.point = turn.point;
  if (const auto turned = end_for_end(turn)) {
    symmetry.two_sided = true;
    symmetry.elements.push_back(*turned);
  }
  return symmetry;
}

/// The elements may be every second or third turn of an axis only.
void GroupSearch::try_finer_turns() {
  for (bool is_finer = true; is_finer;) {
    is_finer = false;
    for (const Turn& axis : axes()) {
      const int fold = fold_of(axis.axis);
      for (const int parts : {2, 3}) {
        if (fold * parts > options_.max_fold) continue;
        const double angle = 2.0 * std::numbers::pi / (fold * parts);
        if (try_motion(turned_about(axis.axis, axis.point, angle))) is_finer = true;
      }
    }
    if (is_finer) close();
  }
}

/// Where all elements turn about one axis: half turns across it.
void GroupSearch::try_perpendicular_turns() {
  const auto all = axes();
  if (all.size() != 1) return;
  const Turn& main = all[0];
  const Eigen::Vector3d on_axis = surface_.halfway(main.axis, main.point);
  const Eigen::Vector3d across = main.axis.unitOrthogonal();
  const double range_deg = 180.0 / fold_of(main.axis);
  const int steps = std::max(1, static_cast<int>(range_deg / 5.0));
  for (int k = 0; k < steps; ++k) {
    const Eigen::AngleAxisd turn(to_radians(range_deg * k / steps), main.axis);
    const auto found = surface_.symmetric_near(turned_about(turn * across, on_axis, std::numbers::pi));
    if (!found || holds(*found)) continue;
    elements_.push_back(*found);
    close();
    return;
  }
}

int GroupSearch::fold_of(const Eigen::Vector3d& axis) const {
  int count = 1;
  for (std::size_t i = 1; i < elements_.size(); ++i) {
    const Eigen::Vector3d own = Eigen::AngleAxisd(elements_[i].linear()).axis();
    count += angle_between_lines(own, axis) < 2.0 * to_radians(options_.same_deg) ? 1 : 0;
  }
  return count;
}

/// The point that all elements leave where it is; along an axis that all share, the one nearest to the middle.
Eigen::Vector3d GroupSearch::centre() const {
  Eigen::Matrix3d normal = 1e-6 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const Eigen::Vector3d& middle = surface_.middle();
  for (const Transform& e : elements_) {
    const Eigen::Matrix3d a = Eigen::Matrix3d::Identity() - e.linear();
    normal += a.transpose() * a;
    right += a.transpose() * (e * middle - middle);
  }
  return middle + normal.ldlt().solve(right);
}

Symmetry GroupSearch::finite() const {
  Symmetry symmetry;
  symmetry.elements = elements_;
  symmetry.motions = elements_.size();
  symmetry.point = centre();
  std::vector<Turn> all = axes();
  if (all.empty()) return symmetry;
  const auto before = [&](const Turn& a, const Turn& b) {  // the highest fold, of these the most upright
    const int fold_a = fold_of(a.axis), fold_b = fold_of(b.axis);
    return fold_a != fold_b ? fold_a > fold_b : std::abs(a.axis.y()) > std::abs(b.axis.y());
  };
  std::ranges::stable_sort(all, before);
  symmetry.fold = fold_of(all[0].axis);
  symmetry.axis = all[0].axis.y() < 0.0 ? Eigen::Vector3d(-all[0].axis) : all[0].axis;
  const auto fold = static_cast<std::size_t>(symmetry.fold);
  using Group = Symmetry::Group;
  if (all.size() == 1) {
    symmetry.group = Group::cyclic;
  } else if (elements_.size() == 2 * fold && all.size() == 1 + fold) {
    symmetry.group = Group::dihedral;
  } else if (elements_.size() == 12 && fold == 3) {
    symmetry.group = Group::tetrahedral;
  } else if (elements_.size() == 24 && fold == 4) {
    symmetry.group = Group::cubic;
  } else if (elements_.size() == 60 && fold == 5) {
    symmetry.group = Group::icosahedral;
  } else {
    symmetry.group = Group::other;
  }
  return symmetry;
}

std::optional<Symmetry> GroupSearch::find(std::span<const Transform> motions) {
  for (const Transform& motion : motions) {
    if (holds(motion)) continue;
    auto found = surface_.symmetric_near(motion);
    if (!found || !is_same(*found, motion)) {  // it may have slid along a free turn
      const Turn own = rotation_about(motion, surface_.middle());
      const FreeTurn held{own.axis, own.point};
      found = surface_.symmetric_near(motion, {&held, 1});
    }
    if (!found || !is_same(*found, motion)) return std::nullopt;
    if (!holds(*found)) elements_.push_back(*found);
  }
  for (const Turn& turn : axes()) {
    if (is_axial(turn)) return continuous(turn);
  }
  close();
  try_finer_turns();
  try_perpendicular_turns();
  if (!is_closed()) return std::nullopt;  // turns by any angles, and yet not free: no group has them
  return finite();
}

}  // namespace

std::vector<FreeTurn> Symmetry::free_turns() const {
  if (group == Group::axial) return {{axis, point}};
  if (group != Group::spherical) return {};
  return {{Eigen::Vector3d::UnitX(), point}, {Eigen::Vector3d::UnitY(), point}, {Eigen::Vector3d::UnitZ(), point}};
}

const char* to_string(Symmetry::Group group) {
  switch (group) {
    case Symmetry::Group::none: return "none";
    case Symmetry::Group::cyclic: return "cyclic";
    case Symmetry::Group::dihedral: return "dihedral";
    case Symmetry::Group::axial: return "axial";
    case Symmetry::Group::spherical: return "spherical";
    case Symmetry::Group::tetrahedral: return "tetrahedral";
    case Symmetry::Group::cubic: return "cubic";
    case Symmetry::Group::icosahedral: return "icosahedral";
    case Symmetry::Group::other: return "other";
  }
  return "other";
}

const char* to_string(Symmetry::Of of) {
  switch (of) {
    case Symmetry::Of::both_poses: return "both poses";
    case Symmetry::Of::pose1: return "pose 1";
    case Symmetry::Of::pose2: return "pose 2";
  }
  return "both poses";
}

std::string describe(const Symmetry& symmetry) {
  const std::string what = symmetry.of == Symmetry::Of::both_poses
                               ? "the part"
                               : fmt::format("what {} shows of the part", to_string(symmetry.of));
  switch (symmetry.group) {
    case Symmetry::Group::none: return fmt::format("{} has no symmetry", what);
    case Symmetry::Group::axial:
      return fmt::format("{} is the same after every turn about one axis{}", what,
                         symmetry.two_sided ? ", and turned end for end" : "");
    case Symmetry::Group::spherical: return fmt::format("{} is a ball: the same after every turn", what);
    case Symmetry::Group::cyclic:
      return fmt::format("{} is the same after each turn by {:.4g} deg about one axis", what, 360.0 / symmetry.fold);
    case Symmetry::Group::dihedral:
      return fmt::format("{} is the same after each turn by {:.4g} deg about one axis, and turned end for end", what,
                         360.0 / symmetry.fold);
    default: return fmt::format("{} is the same in {} positions", what, symmetry.motions);
  }
}

std::optional<Symmetry> find_symmetry(const SelfComparison& surface, std::span<const Transform> motions,
                                      const SymmetryOptions& options) {
  return GroupSearch(surface, options).find(motions);
}

}  // namespace scanrig
