#include "pipeline/calibration/judge/rig_changes.h"

#include <Eigen/Dense>
#include <cmath>
#include <functional>

namespace scanrig {
namespace {

constexpr double kMinChi2 = 40.0;
constexpr double kMinShiftPx = 0.01;

/// Further unknowns: combinations of the solution's columns, in some of its sightings only.
struct ExtraUnknowns {
  Columns columns;
  Eigen::MatrixXd combine;  ///< columns by further unknowns
  std::function<bool(const Sighting&)> applies;
};

struct Gain {
  double chi2 = 0.0;
  double shift_px = 0.0;
};

class ScoreTest {
 public:
  explicit ScoreTest(const CalibrationSolution& solution)
      : linear_(solution.linear), normal_(solution.normal), setup_(solution.start.setup) {}

  [[nodiscard]] Gain of(const ExtraUnknowns& extra) const {
    const Eigen::Index q = extra.combine.cols();
    Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(linear_.columns, q), own = Eigen::MatrixXd::Zero(q, q);
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(q);
    double rows = 0.0;
    for (std::size_t i = 0; i < setup_.sightings.size(); ++i) {
      if (!extra.applies(setup_.sightings[i])) continue;
      for (std::size_t row = 2 * i; row < 2 * i + 2; ++row) {
        const Eigen::VectorXd e = extra.combine.transpose() * part_of(row, extra.columns);
        for (int at = linear_.row_start[row]; at < linear_.row_start[row + 1]; ++at) {
          const auto k = static_cast<std::size_t>(at);
          cross.row(linear_.column[k]) += linear_.value[k] * e.transpose();
        }
        own += e * e.transpose();
        slope -= e * linear_.residual[row];
        rows += 1.0;
      }
    }
    if (rows == 0.0) return {};
    const Eigen::MatrixXd half = normal_.half_solve(cross);
    const Eigen::MatrixXd left = own - half.transpose() * half;
    const Eigen::LDLT<Eigen::MatrixXd> solver(left);
    if (!(left.diagonal().array() > 1e-6 * own.diagonal().array()).all()) return {};  // not seen apart
    const Eigen::VectorXd step = solver.solve(slope);
    return {slope.dot(step), setup_.sigma_px * std::sqrt(2.0 * step.dot(own * step) / rows)};
  }

 private:
  [[nodiscard]] Eigen::VectorXd part_of(std::size_t row, const Columns& columns) const {
    Eigen::VectorXd part = Eigen::VectorXd::Zero(columns.count);
    for (int at = linear_.row_start[row]; at < linear_.row_start[row + 1]; ++at) {
      const int column = linear_.column[static_cast<std::size_t>(at)] - columns.first;
      if (column >= 0 && column < columns.count) part[column] = linear_.value[static_cast<std::size_t>(at)];
    }
    return part;
  }

  const Linearised& linear_;
  const NormalMatrix& normal_;
  const BundleSetup& setup_;
};

/// A camera turns about its centre, across its line of sight: moves all pixels alike.
ExtraUnknowns camera_turn(const CalibrationSolution& solution, int camera, int after) {
  const auto c = static_cast<std::size_t>(camera);
  const Transform pose = to_transform(solution.start.unknowns.cameras[c].camera_from_table);
  ExtraUnknowns extra{solution.linear.pose[c], Eigen::MatrixXd::Zero(6, 2), {}};
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector3d turn = Eigen::Vector3d::Unit(axis);
    extra.combine.col(axis) << turn, turn.cross(pose.translation());
  }
  const std::vector<int>& placements = solution.start.setup.placement_of_pair;
  extra.applies = [camera, after, &placements](const Sighting& s) {
    return s.camera == camera && placements[static_cast<std::size_t>(s.pair)] > after;
  };
  return extra;
}

ExtraUnknowns board_slip(const CalibrationSolution& solution, int placement, int from_pair) {
  const std::vector<int>& placements = solution.start.setup.placement_of_pair;
  ExtraUnknowns extra{
      solution.linear.placements[static_cast<std::size_t>(placement)], Eigen::MatrixXd::Identity(6, 6), {}};
  extra.applies = [placement, from_pair, &placements](const Sighting& s) {
    return !s.is_dot && s.pair >= from_pair && placements[static_cast<std::size_t>(s.pair)] == placement;
  };
  return extra;
}

}  // namespace

std::optional<RigChange> find_change(const CalibrationInput& input, const CalibrationSolution& solution) {
  const ScoreTest test(solution);
  std::optional<RigChange> best;
  const auto consider = [&](const Gain& gain, RigChange change) {
    change.chi2 = gain.chi2;
    change.shift_px = gain.shift_px;
    if (gain.chi2 > kMinChi2 && gain.shift_px > kMinShiftPx && (!best || gain.chi2 > best->chi2)) best = change;
  };
  const std::vector<int>& placements = solution.start.setup.placement_of_pair;
  for (std::size_t k = 1; k < placements.size(); ++k) {
    const int before = input.pairs[k - 1].placement;
    if (placements[k] != placements[k - 1]) {
      for (int camera = 0; camera < input.cameras && placements[k] > placements[k - 1]; ++camera) {
        if (solution.linear.pose[static_cast<std::size_t>(camera)].count != 6) continue;
        consider(test.of(camera_turn(solution, camera, placements[k - 1])),
                 {RigChange::Kind::camera, camera, before, 0.0, 0.0});
      }
    } else if (solution.linear.placements[static_cast<std::size_t>(placements[k])].count == 6) {
      consider(test.of(board_slip(solution, placements[k], static_cast<int>(k))),
               {RigChange::Kind::board, 0, before, 0.0, 0.0});
    }
  }
  return best;
}

}  // namespace scanrig
