#include "pipeline/calibration/judge/rig_changes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/statistics.h"

namespace scanrig {
namespace {

constexpr double kMinChi2 = 40.0;
constexpr double kMinShiftPx = 0.01;
constexpr double kAgreement = 0.9;       ///< of a camera's images with a motion between two placements
constexpr double kUneven = 2.0;          ///< misfit of the worst placement over that of the middle one
constexpr double kMedianChi2Of6 = 5.35;  ///< of six unknowns that explain nothing
constexpr std::size_t kFewSlips = 6;     ///< of other placements: too few to know their misfit
constexpr double kFocusShare = 0.3;      ///< of the chi-square that only the focal length explains

/// Further unknowns: combinations of the solution's columns, in some of its sightings only.
struct ExtraUnknowns {
  Columns columns;
  Eigen::MatrixXd combine;                        ///< columns by further unknowns
  std::function<double(const Sighting&)> weight;  ///< 0: not in this sighting
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
      const double weight = extra.weight(setup_.sightings[i]);
      if (weight == 0.0) continue;
      for (std::size_t row = 2 * i; row < 2 * i + 2; ++row) {
        const Eigen::VectorXd e = weight * (extra.combine.transpose() * part_of(row, extra.columns));
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

int columns_end(const Columns& columns) { return columns.first + columns.count; }

/// Lens and pose of a camera lie side by side among the solution's columns.
Columns lens_and_pose(const Linearised& linear, std::size_t camera) {
  const Columns &lens = linear.lens[camera], &pose = linear.pose[camera];
  return {lens.first, columns_end(pose) - lens.first};
}

/// A camera turns about its centre, across its line of sight: moves all pixels alike. With `focus` its focal length
/// changes as well.
ExtraUnknowns camera_turn(const CalibrationSolution& solution, int camera, bool focus,
                          std::function<double(const Sighting&)> weight) {
  const auto c = static_cast<std::size_t>(camera);
  const Transform pose = to_transform(solution.start.unknowns.cameras[c].camera_from_table);
  const Columns columns = lens_and_pose(solution.linear, c);
  ExtraUnknowns extra{columns, Eigen::MatrixXd::Zero(columns.count, focus ? 3 : 2), std::move(weight)};
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector3d turn = Eigen::Vector3d::Unit(axis);
    extra.combine.col(axis).segment<6>(solution.linear.pose[c].first - columns.first) << turn,
        turn.cross(pose.translation());
  }
  if (focus) extra.combine(0, 2) = solution.start.unknowns.cameras[c].lens[0];
  return extra;
}

/// The images of a camera after a placement.
std::function<double(const Sighting&)> after(const CalibrationSolution& solution, int camera, int placement) {
  const std::vector<int>& placements = solution.start.setup.placement_of_pair;
  return [camera, placement, &placements](const Sighting& s) {
    return s.camera == camera && placements[static_cast<std::size_t>(s.pair)] > placement ? 1.0 : 0.0;
  };
}

/// From 0 at the first pair to 1 at the last one.
std::function<double(const Sighting&)> gradually(int camera, std::size_t pairs) {
  return [camera, last = static_cast<double>(pairs - 1)](const Sighting& s) {
    return s.camera == camera ? s.pair / last : 0.0;
  };
}

ExtraUnknowns board_slip(const CalibrationSolution& solution, int placement, int from_pair) {
  const std::vector<int>& placements = solution.start.setup.placement_of_pair;
  ExtraUnknowns extra{
      solution.linear.placements[static_cast<std::size_t>(placement)], Eigen::MatrixXd::Identity(6, 6), {}};
  extra.weight = [placement, from_pair, &placements](const Sighting& s) {
    const bool applies = !s.is_dot && s.pair >= from_pair && placements[static_cast<std::size_t>(s.pair)] == placement;
    return applies ? 1.0 : 0.0;
  };
  return extra;
}

class ChangeSearch {
 public:
  ChangeSearch(const CalibrationInput& input, const CalibrationSolution& solution)
      : input_(input), solution_(solution), test_(solution) {}

  std::optional<RigChange> find() {
    const std::vector<int>& placements = solution_.start.setup.placement_of_pair;
    for (std::size_t k = 1; k < placements.size(); ++k) {
      if (placements[k] > placements[k - 1]) {
        for (int camera = 0; camera < input_.cameras; ++camera) try_step(camera, k);
      } else if (placements[k] == placements[k - 1]) {
        try_slip(k);
      }
    }
    for (int camera = 0; camera < input_.cameras && input_.form == CalibrationInput::Form::table; ++camera) {
      if (!is_solved_for(camera)) continue;
      const auto gain = test_.of(camera_turn(solution_, camera, false, gradually(camera, placements.size())));
      consider(gain, {.kind = RigChange::Kind::drift, .camera = camera, .share = 0.5}, camera_);
    }
    choose_slip();
    const bool is_slip = slip_ && (!camera_ || (slip_->chi2 > camera_->chi2 && !others_fit_badly(slip_->placement)));
    return is_slip ? slip_ : camera_;
  }

 private:
  /// A slip leaves the other placements as they were; what a camera does shows in several of them.
  [[nodiscard]] bool others_fit_badly(int slipped) const {
    struct Misfit {
      double chi2 = 0.0, rows = 0.0;
    };
    std::map<int, Misfit> of;
    const BundleSetup& setup = solution_.start.setup;
    for (std::size_t i = 0; i < setup.sightings.size(); ++i) {
      const Sighting& s = setup.sightings[i];
      if (s.is_dot) continue;
      Misfit& misfit = of[input_.pairs[static_cast<std::size_t>(s.pair)].placement];
      misfit.chi2 += std::pow(solution_.linear.residual[2 * i], 2) + std::pow(solution_.linear.residual[2 * i + 1], 2);
      misfit.rows += 2.0;
    }
    std::vector<double> others;
    for (const auto& [placement, misfit] : of) {
      if (placement != slipped) others.push_back(misfit.chi2 / misfit.rows);
    }
    return others.size() > 2 && std::ranges::max(others) > kUneven * quantile(others, 0.5);
  }

  [[nodiscard]] bool is_solved_for(int camera) const {
    const auto c = static_cast<std::size_t>(camera);
    return solution_.linear.pose[c].count == 6 && solution_.linear.lens[c].count == 9;
  }

  /// The change may be a turn alone, or one of the focus.
  void try_step(int camera, std::size_t pair) {
    if (!is_solved_for(camera)) return;
    const auto& placements = solution_.start.setup.placement_of_pair;
    const auto weight = after(solution_, camera, placements[pair - 1]);
    const Gain turn = test_.of(camera_turn(solution_, camera, false, weight));
    const Gain focus = test_.of(camera_turn(solution_, camera, true, weight));
    RigChange change{.camera = camera, .placement = input_.pairs[pair - 1].placement};
    change.share = static_cast<double>(pair) / static_cast<double>(placements.size());
    if (focus.chi2 - turn.chi2 > std::max(kMinChi2, kFocusShare * focus.chi2)) {
      change.kind = RigChange::Kind::focus;
      return consider(focus, change, camera_);
    }
    consider(turn, change, camera_);
  }

  void try_slip(std::size_t pair) {
    const int placement = solution_.start.setup.placement_of_pair[pair];
    if (solution_.linear.placements[static_cast<std::size_t>(placement)].count != 6) return;
    possible_slips_.push_back({test_.of(board_slip(solution_, placement, static_cast<int>(pair))),
                               {.kind = RigChange::Kind::board, .placement = input_.pairs[pair - 1].placement}});
  }

  /// What the model does not follow, a lens or an axis, shows as slips of every placement. One that slipped stands out.
  [[nodiscard]] double misfit_of_others(int slipped) const {
    std::vector<double> others;
    for (const auto& [gain, change] : possible_slips_) {
      if (change.placement != slipped) others.push_back(gain.chi2);
    }
    return others.size() < kFewSlips ? 1.0 : std::max(1.0, quantile(std::move(others), 0.5) / kMedianChi2Of6);
  }

  void choose_slip() {
    for (auto [gain, change] : possible_slips_) {
      gain.chi2 /= misfit_of_others(change.placement);
      consider(gain, change, slip_);
    }
  }

  static void consider(const Gain& gain, RigChange change, std::optional<RigChange>& best) {
    change.chi2 = gain.chi2;
    change.shift_px = gain.shift_px;
    if (gain.chi2 > kMinChi2 && gain.shift_px > kMinShiftPx && (!best || gain.chi2 > best->chi2)) best = change;
  }

  const CalibrationInput& input_;
  const CalibrationSolution& solution_;
  const ScoreTest test_;
  std::vector<std::pair<Gain, RigChange>> possible_slips_;
  std::optional<RigChange> slip_, camera_;  ///< the best of each
};

}  // namespace

std::optional<RigChange> find_change(const CalibrationInput& input, const CalibrationSolution& solution) {
  return ChangeSearch(input, solution).find();
}

std::optional<RigChange> find_large_motion(const SolvedCalibration& solved) {
  const auto does_not_fit = [](const ImageFit& image) { return !image.is_used && image.median_px > kMinShiftPx; };
  for (int camera = 0; camera < solved.cameras; ++camera) {
    std::vector<const ImageFit*> images;  // in order of time
    for (const ImageFit& image : solved.images) {
      if (image.camera == camera && image.corners > 0) images.push_back(&image);
    }
    for (std::size_t k = 1; k < images.size(); ++k) {
      if (images[k]->placement == images[k - 1]->placement) continue;
      const auto agree = [&](bool before) {
        double count = 0.0;
        for (std::size_t i = 0; i < images.size(); ++i)
          count += does_not_fit(*images[i]) == (before == (i < k)) ? 1 : 0;
        return count / static_cast<double>(images.size());
      };
      if (std::max(agree(true), agree(false)) < kAgreement) continue;
      RigChange change{.camera = camera, .placement = images[k - 1]->placement};
      std::vector<double> shifts;
      for (const ImageFit* image : images) {
        if (does_not_fit(*image)) shifts.push_back(image->median_px);
      }
      change.shift_px = quantile(shifts, 0.5);
      change.share = static_cast<double>(k) / static_cast<double>(images.size());
      return change;
    }
  }
  return std::nullopt;
}

}  // namespace scanrig
