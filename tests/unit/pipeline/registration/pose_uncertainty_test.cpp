#include "pipeline/registration/pose_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "core/units.h"

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// The frame of a turntable whose axis is off.
Transform frame_off(const Eigen::Vector3d& turn, const Eigen::Vector3d& shift) {
  Transform off = Transform::Identity();
  off.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  off.translation() = shift;
  return off;
}

/// Error of a motion at `centre`: rotation vector and translation.
Vector6 error_of(const Transform& seen, const Transform& true_motion, const Eigen::Vector3d& centre) {
  const Transform off = seen * true_motion.inverse();
  const Eigen::AngleAxisd turn(off.linear());
  Vector6 error;
  error << turn.angle() * turn.axis(), off * centre - centre;
  return error;
}

TEST(PoseUncertainty, AWrongAxisSpreadsTheMotionAsPredicted) {
  const AxisUncertainty axis{to_radians(0.01), 0.02};
  Transform motion = Transform::Identity();
  motion.linear() =
      Eigen::AngleAxisd(to_radians(140.0), Eigen::Vector3d(0.8, 0.1, 0.6).normalized()).toRotationMatrix();
  motion.translation() = Eigen::Vector3d(4.0, 70.0, -9.0);
  const Eigen::Vector3d centre(5.0, 40.0, 8.0);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> spread = Eigen::Matrix<double, 6, 6>::Zero();
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Transform frame = frame_off(axis.tilt_rad * Eigen::Vector3d(normal(random), 0.0, normal(random)),
                                      axis.shift_mm * Eigen::Vector3d(normal(random), 0.0, normal(random)));
    const Vector6 error = error_of(frame * motion * frame.inverse(), motion, centre);
    spread += error * error.transpose() / kTrials;
  }
  const auto predicted = axis_covariance(motion, centre, axis);
  const Vector6 sigma = predicted.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(spread(i, j), predicted(i, j), 0.05 * sigma[i] * sigma[j]) << i << " " << j;
  }
}

TEST(PoseUncertainty, NothingOfAMotionThatIsNone) {
  const auto none = axis_covariance(Transform::Identity(), {1.0, 50.0, 2.0}, {to_radians(0.01), 0.02});
  EXPECT_LT(none.norm(), 1e-20);
}

std::vector<MotionScore> scores_of_weight(std::vector<MotionScore> scores, double weight) {
  for (MotionScore& s : scores) s.weight *= weight;
  return scores;
}

/// Points of a body of revolution, of which only views 0 and 1 of either pose show a handle, which holds its turn.
std::vector<MotionScore> turned_body(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<MotionScore> scores;
  for (int view1 = 0; view1 < 8; ++view1) {
    for (int view2 = 0; view2 < 8; ++view2) {
      if (std::min((view1 - view2 + 8) % 8, (view2 - view1 + 8) % 8) > 1) continue;
      for (int k = 0; k < 40; ++k) {
        const double azimuth = to_radians(45.0 * view1 + 30.0 * any(random)), slope = 0.7 * any(random);
        const Eigen::Vector3d out(std::sin(azimuth), 0.0, std::cos(azimuth));
        Eigen::Vector3d point = 30.0 * out + 40.0 * any(random) * Eigen::Vector3d::UnitY();
        Eigen::Vector3d normal = (out + slope * Eigen::Vector3d::UnitY()).normalized();
        if (k < 4 && view1 < 2 && view2 < 2) {
          point = 50.0 * out;
          normal = Eigen::Vector3d::UnitY().cross(out);
        }
        MotionScore score{.weight = 1.0, .view1 = view1, .view2 = view2, .point = point};
        score.lever << point.cross(normal), normal;
        scores.push_back(score);
      }
    }
  }
  return scores;
}

/// The same body, of which all views show everything: they agree, whatever is wrong with its surface.
std::vector<MotionScore> body_seen_by_all(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<MotionScore> scores;
  for (int pair = 0; pair < 64; ++pair) {
    for (int k = 0; k < 40; ++k) {
      const bool is_handle = k < 4;
      const double azimuth = to_radians((is_handle ? 40.0 : 180.0) * any(random)), slope = 0.7 * any(random);
      const Eigen::Vector3d out(std::sin(azimuth), 0.0, std::cos(azimuth));
      Eigen::Vector3d point = 30.0 * out + 40.0 * any(random) * Eigen::Vector3d::UnitY();
      Eigen::Vector3d normal = (out + slope * Eigen::Vector3d::UnitY()).normalized();
      if (is_handle) {
        point = 50.0 * out;
        normal = Eigen::Vector3d::UnitY().cross(out);
      }
      MotionScore score{.weight = 1.0, .view1 = pair / 8, .view2 = pair % 8, .point = point};
      score.lever << point.cross(normal), normal;
      scores.push_back(score);
    }
  }
  return scores;
}

/// Variances of the motion's coordinates, true ones and as predicted, where `wrong` says what is wrong in common with
/// the residual of a score, anew for each draw.
struct Variances {
  Vector6 truth = Vector6::Zero(), predicted = Vector6::Zero();
  double within_two_sigma = 0.0;  ///< share of the coordinates of all draws
};
template <class DrawScores, class DrawWrong>
Variances of_body(DrawScores draw_scores, DrawWrong draw_wrong) {
  constexpr int kDraws = 200;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  Variances variances;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<MotionScore> scores = draw_scores(random);
    auto wrong = draw_wrong(random);
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 right = Vector6::Zero();
    for (MotionScore& s : scores) {
      s.residual = wrong(s) + 0.005 * normal(random);
      information += s.weight * s.lever * s.lever.transpose();
      right -= s.weight * s.residual * s.lever;
    }
    const Vector6 motion = information.ldlt().solve(right);
    for (MotionScore& s : scores) s.residual += s.lever.dot(motion);
    variances.truth += motion.cwiseAbs2() / kDraws;
    const Vector6 predicted = motion_covariance(information * 4e4, scores_of_weight(scores, 4e4)).diagonal();
    variances.predicted += predicted / kDraws;
    const auto within = (motion.cwiseAbs2().array() <= 4.0 * predicted.array()).count();
    variances.within_two_sigma += static_cast<double>(within) / (6.0 * kDraws);
  }
  return variances;
}

/// What the views have wrong in common, each of its own, moves the motion as far as their disagreement predicts.
TEST(PoseUncertainty, TheTurnThatOneHandleHoldsIsNoSurerThanTheViewsThatShowIt) {
  const auto [truth, predicted, within_two_sigma] = of_body(turned_body, [](std::mt19937& random) {
    std::normal_distribution<double> normal;
    std::array<std::array<Vector6, 8>, 2> wrong;
    for (auto& pose : wrong) {
      for (Vector6& view : pose) {
        for (int i = 0; i < 6; ++i) view[i] = (i < 3 ? 2e-4 : 0.01) * normal(random);
      }
    }
    return [wrong](const MotionScore& s) {
      return s.lever.dot(wrong[0][static_cast<std::size_t>(s.view1)] - wrong[1][static_cast<std::size_t>(s.view2)]);
    };
  });
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(predicted[i], 0.8 * truth[i]) << i;
    EXPECT_LT(predicted[i], 3.0 * truth[i]) << i;
  }
  EXPECT_GT(within_two_sigma, 0.95);  // as of a normal distribution, though eight views tell their scatter badly
}

/// What all views have wrong at one place of the surface, as at a cut's edge, is nothing that they disagree about.
TEST(PoseUncertainty, TheTurnThatOneHandleHoldsIsNoSurerThanItsSurface) {
  const auto [truth, predicted, within_two_sigma] = of_body(body_seen_by_all, [](std::mt19937& random) {
    return [own = std::mt19937(random()), at = std::map<std::array<int, 3>, double>()](const MotionScore& s) mutable {
      constexpr double kPlaceMm = 9.0;
      const Eigen::Array3i cell = (s.point.array() / kPlaceMm).round().cast<int>();
      const auto [place, is_new] = at.try_emplace({cell[0], cell[1], cell[2]});
      if (is_new) place->second = 0.02 * std::normal_distribution<double>()(own);
      return place->second;
    };
  });
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(predicted[i], 0.4 * truth[i]) << i;
    EXPECT_LT(predicted[i], 3.0 * truth[i]) << i;
  }
}

/// Depths that a wrong camera makes longer towards the sides of its images.
Eigen::Matrix3Xd bent_depths(const Transform& camera_from_pose, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = camera_from_pose * point;
  Eigen::Matrix3Xd in_camera = Eigen::Matrix3Xd::Zero(3, 2);
  in_camera(2, 0) = 0.02 * p.x() / 50.0;
  in_camera(2, 1) = 0.03 * p.y() * p.y() / 2500.0;
  return camera_from_pose.linear().transpose() * in_camera;
}

TEST(PoseUncertainty, AWrongCalibrationSpreadsTheMotionAsPredicted) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const std::vector<MotionScore> scores = turned_body(random);
  PairOfViews views;
  for (int view = 0; view < 8; ++view) {
    Transform camera_from_pose = rot_y(to_radians(45.0 * view));
    camera_from_pose.pretranslate(Eigen::Vector3d(0.0, -10.0, 600.0));
    views.pose1.push_back(camera_from_pose);
    views.pose2.push_back(camera_from_pose);
  }
  Transform pose1_from_pose2 = Transform::Identity();
  pose1_from_pose2.linear() = Eigen::AngleAxisd(2.0, Eigen::Vector3d(1.0, 0.2, 0.4).normalized()).toRotationMatrix();
  Vector6 true_variance = Vector6::Zero();
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (const MotionScore& s : scores) information += s.weight * s.lever * s.lever.transpose();
  constexpr int kDraws = 2000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::Vector2d wrong(normal(random), normal(random));
    Vector6 right = Vector6::Zero();
    for (const MotionScore& s : scores) {
      const auto view1 = static_cast<std::size_t>(s.view1), view2 = static_cast<std::size_t>(s.view2);
      const Eigen::Vector3d moved =
          pose1_from_pose2.linear() * bent_depths(views.pose2[view2], pose1_from_pose2.inverse() * s.point) * wrong;
      const Eigen::Vector3d apart = moved - bent_depths(views.pose1[view1], s.point) * wrong;
      right -= s.weight * s.lever.tail<3>().dot(apart) * s.lever;
    }
    true_variance += Vector6(information.ldlt().solve(right)).cwiseAbs2() / kDraws;
  }
  const auto pull = pull_of_calibration(scores, views, pose1_from_pose2, bent_depths);
  const Eigen::MatrixXd predicted = covariance_of_pull(information, pull);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(predicted(i, i), true_variance[i], 0.15 * true_variance[i]) << i;
  EXPECT_GT(predicted(1, 1), 0.0);
}

TEST(PoseUncertainty, ACalibrationThatDoesNotSayHowSureItIsAddsNothing) {
  std::mt19937 random(5);
  const auto pull = pull_of_calibration(turned_body(random), {}, Transform::Identity(), {});
  EXPECT_EQ(covariance_of_pull(Eigen::Matrix<double, 6, 6>::Identity(), pull).norm(), 0.0);
}

}  // namespace
}  // namespace scanrig
