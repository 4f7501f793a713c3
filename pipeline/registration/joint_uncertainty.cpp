#include "pipeline/registration/joint_uncertainty.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace scanrig {
namespace {

using ViewOfPose = std::pair<std::size_t, int>;
using ViewPair = std::pair<ViewOfPose, ViewOfPose>;
using Place = std::array<int, 3>;

constexpr double kMaxShare = 0.9;    // of what is known of a direction that one view or place may take with it
constexpr double kPlaceWidth = 0.1;  // of the shared surface's size: what small features are as wide as

template <class Value>
Eigen::MatrixXd with_values(const Eigen::MatrixXd& matrix, const Value& value) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().unaryExpr(value).asDiagonal() * solver.eigenvectors().transpose();
}

/// What the correspondences of one pair of views say of the motion between their poses, all of them or at one place.
struct PairSums {
  Eigen::Matrix<double, 6, 1> pull = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();

  void add(const PairSums& other) {
    pull += other.pull;
    information += other.information;
  }
};

/// Width of a place.
double place_width(std::span<const JointScore> scores) {
  Eigen::AlignedBox3d box;
  for (const JointScore& score : scores) box.extend(score.of_link.point);
  return std::max(kPlaceWidth * box.diagonal().norm(), 1e-9);
}

using PlacedPairs = std::map<std::pair<Place, ViewPair>, PairSums>;

PlacedPairs by_place_and_pair(std::span<const JointScore> scores) {
  const double width = place_width(scores);
  PlacedPairs all;
  for (const auto& [score, pose1, pose2] : scores) {
    const Eigen::Array3i cell = (score.point.array() / width).floor().cast<int>();
    PairSums& sums = all[{{cell[0], cell[1], cell[2]}, {{pose1, score.view1}, {pose2, score.view2}}}];
    sums.pull += score.weight * score.residual * score.lever;
    sums.information.noalias() += score.weight * score.lever * score.lever.transpose();
  }
  return all;
}

void add_pull(Eigen::VectorXd& pull, const ViewPair& views, const PairSums& sums) {
  pull.segment<6>(static_cast<Eigen::Index>(6 * views.second.first)) += sums.pull;
  pull.segment<6>(static_cast<Eigen::Index>(6 * views.first.first)) -= sums.pull;
}

/// The same of all poses, the first one too.
struct GroupSums {
  Eigen::VectorXd pull;
  Eigen::MatrixXd information;

  explicit GroupSums(Eigen::Index size)
      : pull(Eigen::VectorXd::Zero(size)), information(Eigen::MatrixXd::Zero(size, size)) {}
  void add(const ViewPair& views, const PairSums& sums) {
    const auto first = static_cast<Eigen::Index>(6 * views.first.first);
    const auto second = static_cast<Eigen::Index>(6 * views.second.first);
    add_pull(pull, views, sums);
    information.block<6, 6>(first, first) += sums.information;
    information.block<6, 6>(second, second) += sums.information;
    information.block<6, 6>(first, second) -= sums.information;
    information.block<6, 6>(second, first) -= sums.information;
  }
};

/// Finds the motions without a group, in coordinates that are `scale` times as small.
class LeaveOut {
 public:
  LeaveOut(const Eigen::VectorXd& scale, const Eigen::MatrixXd& scaled_information)
      : scale_(scale),
        root_(with_values(scaled_information, [](double e) { return 1.0 / std::sqrt(std::max(e, 1e-9)); })) {}

  /// Outer product of how far they are then from where they are.
  [[nodiscard]] Eigen::MatrixXd operator()(const GroupSums& group) const {
    const Eigen::Index size = scale_.size();  // the first pose stays
    const Eigen::MatrixXd information =
        scale_.asDiagonal() * group.information.bottomRightCorner(size, size) * scale_.asDiagonal();
    const Eigen::VectorXd pull = scale_.cwiseProduct(group.pull.tail(size));
    const Eigen::MatrixXd without =
        with_values(root_ * information * root_, [](double e) { return 1.0 / (1.0 - std::min(e, kMaxShare)); });
    const Eigen::VectorXd moved = root_ * (without * (root_ * pull));
    return moved * moved.transpose();
  }
  /// The same of a group so small that the others hold every direction, by its pull.
  [[nodiscard]] Eigen::MatrixXd of_small(const Eigen::VectorXd& pull) const {
    const Eigen::VectorXd moved = root_ * (root_ * scale_.cwiseProduct(pull.tail(scale_.size())));
    return moved * moved.transpose();
  }

 private:
  Eigen::VectorXd scale_;
  Eigen::MatrixXd root_;  ///< of the inverse of the information
};

/// How much wider than of a normal distribution the interval of 95.45 % of Student's is: a scatter of few groups is
/// itself badly known [Abramowitz and Stegun 26.7.5; GUM, annex G].
double students_factor(double degrees_of_freedom) {
  constexpr double z = 2.0, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  const double n = std::max(degrees_of_freedom, 1.0);
  const double t = z + (z3 + z) / (4.0 * n) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n) +
                   (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n);
  return t / z;
}

/// Scatter without each view, less that without each pair of views, as wide as the pose of the fewest views makes it.
Eigen::MatrixXd scatter_of_views(const PlacedPairs& placed, const LeaveOut& leave_out, Eigen::Index size) {
  std::map<ViewPair, PairSums> pairs;
  for (const auto& [where, sums] : placed) pairs[where.second].add(sums);
  std::map<ViewOfPose, GroupSums> views;
  for (const auto& [pair, sums] : pairs) {
    for (const ViewOfPose& view : {pair.first, pair.second})
      views.try_emplace(view, size).first->second.add(pair, sums);
  }
  std::map<std::size_t, double> count;
  for (const auto& [view, sums] : views) count[view.first] += 1.0;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(size - 6, size - 6);
  for (const auto& [view, sums] : views) {
    const double of_pose = count[view.first];
    scatter += (of_pose - 1.0) / of_pose * leave_out(sums);
  }
  const double all = static_cast<double>(pairs.size());
  for (const auto& [pair, sums] : pairs) {
    GroupSums alone(size);
    alone.add(pair, sums);
    scatter -= (all - 1.0) / all * leave_out(alone);
  }
  if (count.empty()) return scatter;
  const auto fewest = std::ranges::min_element(count, {}, [](const auto& of_pose) { return of_pose.second; });
  return std::pow(students_factor(fewest->second - 1.0), 2) * scatter;
}

/// Scatter without each place, less what that of the views holds already: what each view has wrong at a place.
Eigen::MatrixXd scatter_of_places(const PlacedPairs& placed, const LeaveOut& leave_out, Eigen::Index size) {
  std::map<Place, GroupSums> places;
  std::map<std::pair<Place, ViewOfPose>, Eigen::VectorXd> views;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(size - 6, size - 6);
  for (const auto& [where, sums] : placed) {
    const auto& [place, pair] = where;
    places.try_emplace(place, size).first->second.add(pair, sums);
    Eigen::VectorXd alone = Eigen::VectorXd::Zero(size);
    add_pull(alone, pair, sums);
    scatter += leave_out.of_small(alone);  // in that of both views
    for (const ViewOfPose& view : {pair.first, pair.second}) {
      auto [at, is_new] = views.try_emplace(std::pair(place, view));
      if (is_new) at->second = Eigen::VectorXd::Zero(size);
      add_pull(at->second, pair, sums);
    }
  }
  for (const auto& [where, pull] : views) scatter -= leave_out.of_small(pull);
  for (const auto& [place, sums] : places) scatter += leave_out(sums);
  return scatter;
}

}  // namespace

Eigen::MatrixXd joint_covariance(const Eigen::MatrixXd& information, std::span<const JointScore> scores) {
  // Rotations and translations have other units: each coordinate is scaled by its own information.
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd inverse = with_values(scaled, [](double e) { return 1.0 / std::max(e, 1e-9); });
  const PlacedPairs placed = by_place_and_pair(scores);
  const LeaveOut leave_out(scale, scaled);
  Eigen::MatrixXd covariance = inverse;
  for (const auto& scatter_of : {scatter_of_views, scatter_of_places}) {
    const Eigen::MatrixXd scatter = scatter_of(placed, leave_out, information.rows() + 6);
    covariance += with_values(scatter, [](double e) { return std::max(e, 0.0); });
  }
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace scanrig
