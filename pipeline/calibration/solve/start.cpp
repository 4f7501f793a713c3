#include "pipeline/calibration/solve/start.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/units.h"
#include "pipeline/calibration/solve/board_pose.h"

namespace scanrig {
namespace {

constexpr double kMinTurn = 2.0, kMaxTurn = 120.0;  ///< degrees between two images that show the axis
constexpr double kFlat = 8.0;                       ///< degrees of a board from the table top, before the solution
constexpr int kMinDotPairs = 3;

using Places = std::vector<std::array<std::optional<Transform>, 2>>;  ///< camera_from_board, [pair][camera]

Projection nominal_lens(const CalibrationInput& input) {
  Projection lens;
  lens.width = input.width;
  lens.height = input.height;
  lens.fx = lens.fy = input.nominal_focal_px;
  lens.cx = 0.5 * (input.width - 1);
  lens.cy = 0.5 * (input.height - 1);
  return lens;
}

class Start {
 public:
  Start(const CalibrationInput& input, const UsedImages& used) : input_(input), used_(used) {}

  Result<StartingPoint> find() {
    prepare();
    if (auto placed = place_boards(); !placed) return pass_on(placed);
    left_from_table_ = Transform::Identity();
    if (input_.form == CalibrationInput::Form::table) {
      if (auto axis = place_table(); !axis) return pass_on(axis);
    }
    average_placements();
    if (input_.form == CalibrationInput::Form::table) {
      start_.dot_ids = place_dots();
      settle_height();
    }
    start_.unknowns.cameras[0].camera_from_table = to_block(left_from_table_);
    start_.unknowns.cameras[1].camera_from_table = to_block(right_from_left_ * left_from_table_);
    start_.setup.sightings = collect_sightings(input_, used_, start_.dot_ids);
    return std::move(start_);
  }

 private:
  void prepare() {
    Unknowns& u = start_.unknowns;
    start_.setup.input = &input_;
    std::map<int, int> known;
    for (std::size_t k = 0; k < input_.pairs.size(); ++k) {
      const int key = input_.form == CalibrationInput::Form::table ? input_.pairs[k].placement : static_cast<int>(k);
      start_.setup.placement_of_pair.push_back(known.try_emplace(key, static_cast<int>(known.size())).first->second);
    }
    u.placements.resize(known.size(), PoseBlock{1.0});
    u.motions.resize(input_.pairs.size());
    u.offsets.resize(static_cast<std::size_t>(input_.board.corner_count()));
    u.shape[0] = scale_prior(input_.length).mean;
    const Projection lens = nominal_lens(input_);
    for (auto& camera : u.cameras) camera.lens = {lens.fx, 1.0, lens.cx, lens.cy, 0.0, 0.0, 0.0, 0.0, 0.0};
  }

  /// left_from_board of every pair that has one.
  Result<void> place_boards() {
    const Projection lens = nominal_lens(input_);
    Places places(input_.pairs.size());
    std::vector<Transform> between;
    for (std::size_t k = 0; k < input_.pairs.size(); ++k) {
      if (used_[k][0]) places[k][0] = board_pose(input_.board, input_.pairs[k].left, lens);
      if (used_[k][1] && input_.cameras == 2) places[k][1] = board_pose(input_.board, input_.pairs[k].right, lens);
      if (places[k][0] && places[k][1]) between.push_back(*places[k][1] * places[k][0]->inverse());
    }
    if (input_.cameras == 2) {
      if (between.size() < 2) {
        return fail(ErrorCode::degenerate,
                    "calibration: both cameras must show the board in at least 2 images; found {}", between.size());
      }
      right_from_left_ = middle_motion(between);
    }
    std::size_t found = 0;
    left_from_board_.resize(places.size());
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (places[k][0]) left_from_board_[k] = places[k][0];
      if (!places[k][0] && places[k][1]) left_from_board_[k] = right_from_left_.inverse() * *places[k][1];
      found += left_from_board_[k] ? 1 : 0;
    }
    if (found < 3) return fail(ErrorCode::degenerate, "calibration: {} usable images; take at least 3", found);
    return {};
  }

  Result<void> place_table() {
    std::vector<TableTurn> turns;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double count = 0.0;
    for (std::size_t b = 0; b < input_.pairs.size(); ++b) {
      if (!left_from_board_[b]) continue;
      middle += left_from_board_[b]->translation();
      count += 1.0;
      for (std::size_t a = 0; a < b; ++a) {
        if (!left_from_board_[a] || start_.setup.placement_of_pair[a] != start_.setup.placement_of_pair[b]) continue;
        const double angle = input_.pairs[b].angle_rad - input_.pairs[a].angle_rad;
        if (std::abs(angle) < to_radians(kMinTurn) || std::abs(angle) > to_radians(kMaxTurn)) continue;
        turns.push_back({*left_from_board_[b] * left_from_board_[a]->inverse(), angle});
      }
    }
    const auto axis = find_axis(turns, middle / count);
    if (!axis) {
      return fail(ErrorCode::degenerate,
                  "calibration: the boards do not turn about one axis; check table, angles and clamping of the board");
    }
    // Image rows run down: up is the half of the axis that points to the first rows.
    const bool up = axis->direction.y() < 0.0;
    start_.unknowns.gear[0] = up ? axis->gear : -axis->gear;
    const Eigen::Vector3d y = up ? axis->direction : Eigen::Vector3d(-axis->direction);
    Eigen::Vector3d centres = Eigen::Vector3d::Zero();
    if (input_.cameras == 2) centres = 0.5 * right_from_left_.inverse().translation();
    const Eigen::Vector3d towards = centres - axis->point;
    const Eigen::Vector3d z = (towards - y * y.dot(towards)).normalized();
    left_from_table_.linear() << y.cross(z), y, z;
    left_from_table_.translation() = axis->point;
    return {};
  }

  [[nodiscard]] double turned(std::size_t pair) const {
    return input_.form == CalibrationInput::Form::table ? start_.unknowns.gear[0] * input_.pairs[pair].angle_rad : 0.0;
  }

  void average_placements() {
    Unknowns& u = start_.unknowns;
    for (std::size_t p = 0; p < u.placements.size(); ++p) {
      std::vector<Transform> found;
      for (std::size_t k = 0; k < left_from_board_.size(); ++k) {
        if (start_.setup.placement_of_pair[k] != static_cast<int>(p) || !left_from_board_[k]) continue;
        found.push_back(rot_y(-turned(k)) * left_from_table_.inverse() * *left_from_board_[k]);
      }
      if (!found.empty()) u.placements[p] = to_block(middle_motion(found));
    }
    for (std::size_t k = 0; k < u.motions.size(); ++k) u.motions[k][0] = turned(k);
  }

  /// Where the two rays of a dot pass each other, table frame at angle 0.
  [[nodiscard]] Eigen::Vector3d triangulated(std::size_t pair, const Eigen::Vector2d& left,
                                             const Eigen::Vector2d& right) const {
    const Projection lens = nominal_lens(input_);
    const Eigen::Vector3d a = lens.unproject(left.x(), left.y(), 1.0);
    const Transform left_from_right = right_from_left_.inverse();
    const Eigen::Vector3d b = left_from_right.linear() * lens.unproject(right.x(), right.y(), 1.0);
    const Eigen::Vector3d base = left_from_right.translation();
    Eigen::Matrix2d m;
    m << a.dot(a), -a.dot(b), -a.dot(b), b.dot(b);
    const Eigen::Vector2d along = m.inverse() * Eigen::Vector2d(a.dot(base), -b.dot(base));
    const Eigen::Vector3d in_left = 0.5 * (along.x() * a + base + along.y() * b);
    return rot_y(-turned(pair)) * (left_from_table_.inverse() * in_left);
  }

  std::vector<int> place_dots() {
    std::map<int, std::vector<Transform>> found;
    for (std::size_t k = 0; k < input_.pairs.size() && input_.cameras == 2; ++k) {
      if (!used_[k][0] || !used_[k][1]) continue;
      for (const DotObservation& left : input_.pairs[k].left.dots) {
        for (const DotObservation& right : input_.pairs[k].right.dots) {
          if (left.id != right.id) continue;
          found[left.id].push_back(Transform(Eigen::Translation3d(triangulated(k, left.pixel, right.pixel))));
        }
      }
    }
    std::vector<int> ids;
    for (const auto& [id, places] : found) {
      if (places.size() < kMinDotPairs) continue;
      const Eigen::Vector3d place = middle_motion(places).translation();
      start_.unknowns.dots.push_back({place.x(), place.y(), place.z()});
      ids.push_back(id);
    }
    if (ids.size() >= 3) return ids;
    start_.unknowns.dots.clear();
    return {};
  }

  void settle_height() {
    Unknowns& u = start_.unknowns;
    double sum = 0.0, count = 0.0;
    for (const auto& dot : u.dots) {
      sum += dot[1];
      count += 1.0;
    }
    for (std::size_t p = 0; p < u.placements.size() && u.dots.empty(); ++p) {
      const Transform place = to_transform(u.placements[p]);
      if (!(-place.linear()(1, 2) > std::cos(to_radians(kFlat)))) continue;
      start_.setup.heights.push_back({static_cast<int>(p), input_.board.thickness_mm, input_.priors.thickness_mm});
      sum += place.translation().y() - input_.board.thickness_mm;
      count += 1.0;
    }
    if (count == 0.0) {
      start_.is_height_known = false;
      start_.setup.heights.push_back({0, 0.0, 1e-3});
      sum = u.placements[0][5];
      count = 1.0;
    }
    const double table_top = sum / count;
    for (auto& placement : u.placements) placement[5] -= table_top;
    for (auto& dot : u.dots) dot[1] -= table_top;
    left_from_table_ = left_from_table_ * Eigen::Translation3d(0.0, table_top, 0.0);
  }

  const CalibrationInput& input_;
  const UsedImages& used_;
  StartingPoint start_;
  std::vector<std::optional<Transform>> left_from_board_;
  Transform right_from_left_ = Transform::Identity();
  Transform left_from_table_ = Transform::Identity();
};

}  // namespace

std::vector<Sighting> collect_sightings(const CalibrationInput& input, const UsedImages& used,
                                        const std::vector<int>& dot_ids) {
  std::vector<Sighting> found;
  for (std::size_t k = 0; k < input.pairs.size(); ++k) {
    for (int camera = 0; camera < input.cameras; ++camera) {
      if (!used[k][static_cast<std::size_t>(camera)]) continue;
      const BoardSight& sight = camera == 0 ? input.pairs[k].left : input.pairs[k].right;
      for (const CornerObservation& corner : sight.corners) {
        found.push_back({static_cast<int>(k), camera, corner.id, false, corner.pixel});
      }
      for (const DotObservation& dot : sight.dots) {
        const auto at = std::find(dot_ids.begin(), dot_ids.end(), dot.id);
        if (at == dot_ids.end()) continue;
        found.push_back({static_cast<int>(k), camera, static_cast<int>(at - dot_ids.begin()), true, dot.pixel});
      }
    }
  }
  return found;
}

Result<StartingPoint> find_start(const CalibrationInput& input, const UsedImages& used) {
  return Start(input, used).find();
}

}  // namespace scanrig
