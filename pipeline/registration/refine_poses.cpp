#include "pipeline/registration/refine_poses.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/statistics.h"
#include "pipeline/registration/joint_uncertainty.h"
#include "pipeline/registration/pose_equations.h"

namespace scanrig {
namespace {

/// One link during the refinement.
struct Tie {
  const PoseLink& link;
  RefineOptions options;
  double capture = 0.0;
  PoseCorrespondences found{};
};

/// All poses at one level.
struct Adjustment {
  std::vector<MeasuredPose> measured;
  std::vector<Transform> model_from_pose;
  std::vector<Tie> ties;
  double arm = 0.0;  ///< half of the mean size
};

Transform relative(const Adjustment& a, const PoseLink& link) {
  return a.model_from_pose[link.pose1].inverse() * a.model_from_pose[link.pose2];
}

void find_all(Adjustment& a, int level) {
  for (Tie& tie : a.ties) {
    tie.found = find_both_ways(a.measured[tie.link.pose1], a.measured[tie.link.pose2], relative(a, tie.link), level,
                               tie.capture, tie.options);
  }
}

Result<void> check_links(const Adjustment& a, int level, const RefineOptions& options) {
  for (const Tie& tie : a.ties) {
    const auto& [pose1, pose2] = std::pair(tie.link.pose1, tie.link.pose2);
    const double samples =
        static_cast<double>(a.measured[pose1].samples[level].size() + a.measured[pose2].samples[level].size());
    const double overlap = static_cast<double>(tie.found.samples_seen) / samples;
    if (tie.found.all.size() < options.min_correspondences || overlap < options.min_overlap) {
      return fail(ErrorCode::no_overlap,
                  "pose refinement: poses {} and {} share {:.1f} % of their surface from this start; at least {:.0f} % "
                  "are needed",
                  pose1 + 1, pose2 + 1, 100.0 * overlap, 100.0 * options.min_overlap);
    }
  }
  return {};
}

Eigen::Vector3d centre_of(const Adjustment& a) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const Tie& tie : a.ties) {
    for (const PoseCorrespondence& c : tie.found.all) sum += a.model_from_pose[tie.link.pose1] * c.moving;
    count += static_cast<double>(tie.found.all.size());
  }
  return sum / count;
}

/// Takes a motion about `centre` in the model's frame to the same about the link's own centre in pose 1 of the link.
Matrix6 to_link(const Transform& model_from_pose1, const Eigen::Vector3d& link_centre, const Eigen::Vector3d& centre) {
  const Eigen::Matrix3d turn = model_from_pose1.linear().transpose();
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = turn;
  m.bottomLeftCorner<3, 3>() = -turn * cross_matrix(model_from_pose1 * link_centre - centre);
  return m;
}

/// Normal equations of all poses, the first included.
struct JointEquations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
};

/// What tells how well all poses are known.
struct JointEvidence {
  std::vector<JointScore> scores;
  Eigen::MatrixXd calibration_pull;  ///< of all poses, the first included; see pull_of_calibration()
};

/// With `evidence` of the surfaces alone: without contacts and held turns.
JointEquations joint_equations(const Adjustment& a, const Eigen::Vector3d& centre, JointEvidence* evidence) {
  const auto size = static_cast<Eigen::Index>(6 * a.measured.size());
  JointEquations joint{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  for (const Tie& tie : a.ties) {
    std::vector<MotionScore> of_link;
    MotionEquations e = motion_equations(tie.found, tie.options, evidence != nullptr ? &of_link : nullptr);
    const Matrix6 m = to_link(a.model_from_pose[tie.link.pose1], e.centre, centre);
    if (evidence == nullptr) {
      add_contacts(tie.options, relative(a, tie.link), e);
      hold_turns(tie.options, e);
    }
    const Matrix6 normal = m.transpose() * e.normal * m;
    const Vector6 right = m.transpose() * e.right;
    const auto first = static_cast<Eigen::Index>(6 * tie.link.pose1);
    const auto second = static_cast<Eigen::Index>(6 * tie.link.pose2);
    joint.normal.block<6, 6>(first, first) += normal;
    joint.normal.block<6, 6>(second, second) += normal;
    joint.normal.block<6, 6>(first, second) -= normal;
    joint.normal.block<6, 6>(second, first) -= normal;
    joint.right.segment<6>(second) += right;
    joint.right.segment<6>(first) -= right;
    if (evidence == nullptr) continue;
    const MeasuredPose &pose1 = a.measured[tie.link.pose1], &pose2 = a.measured[tie.link.pose2];
    const Eigen::MatrixXd pull = m.transpose() * pull_of_calibration(of_link, views_of(pose1, pose2),
                                                                     relative(a, tie.link), tie.options.calibration);
    if (evidence->calibration_pull.size() == 0) evidence->calibration_pull.setZero(size, pull.cols());
    evidence->calibration_pull.middleRows<6>(second) += pull;
    evidence->calibration_pull.middleRows<6>(first) -= pull;
    for (MotionScore& score : of_link) {
      score.lever = m.transpose() * score.lever;
      score.point = a.model_from_pose[tie.link.pose1] * score.point;
      evidence->scores.push_back({score, tie.link.pose1, tie.link.pose2});
    }
  }
  return joint;
}

/// One Gauss-Newton step; returns how far it moved any pose's surface at most, mm.
double step(Adjustment& a) {
  const Eigen::Vector3d centre = centre_of(a);
  const JointEquations joint = joint_equations(a, centre, nullptr);
  const Eigen::Index size = joint.right.size() - 6;
  Eigen::MatrixXd normal = joint.normal.bottomRightCorner(size, size);
  for (Eigen::Index first = 0; first < size; first += 6) {
    normal.diagonal().segment<6>(first).array() += 1e-9 * normal.block<6, 6>(first, first).trace();
  }
  const Eigen::VectorXd x = normal.ldlt().solve(joint.right.tail(size));
  double moved = 0.0;
  const Eigen::Translation3d to_centre(centre);
  for (std::size_t pose = 1; pose < a.measured.size(); ++pose) {
    const auto at = static_cast<Eigen::Index>(6 * (pose - 1));
    const Eigen::Vector3d turn = x.segment<3>(at), shift = x.segment<3>(at + 3);
    a.model_from_pose[pose] = to_centre * small_motion(turn, shift) * to_centre.inverse() * a.model_from_pose[pose];
    moved = std::max(moved, turn.norm() * a.arm + shift.norm());
  }
  return moved;
}

/// Returns the number of steps.
Result<int> refine_level(Adjustment& a, int level, const RefineOptions& options) {
  const double narrowest = 2.0 * options.min_capture * a.arm;
  find_all(a, level);
  for (int done = 1; done <= options.max_iterations; ++done) {
    if (auto ok = check_links(a, level, options); !ok) return pass_on(ok);
    const double moved = step(a);
    for (Tie& tie : a.ties) {
      tie.capture = std::clamp(options.capture_medians * quantile(distances_found(tie.found), 0.5),
                               std::min(narrowest, tie.capture), tie.capture);
    }
    find_all(a, level);
    if (moved < (level == 0 ? options.settled_mm : options.coarse_settled_mm)) return done;
  }
  return options.max_iterations;
}

void describe_fit(const Adjustment& a, RefinedPoses& result) {
  std::vector<double> all;
  for (const Tie& tie : a.ties) {
    const std::vector<double> distances = distances_found(tie.found);
    const double samples = static_cast<double>(a.measured[tie.link.pose1].samples[0].size() +
                                               a.measured[tie.link.pose2].samples[0].size());
    result.links.push_back({quantile(distances, 0.5), root_mean_square(distances),
                            static_cast<double>(tie.found.samples_seen) / samples, static_cast<int>(distances.size())});
    all.insert(all.end(), distances.begin(), distances.end());
  }
  result.median_mm = quantile(all, 0.5);
  result.rms_mm = root_mean_square(all);
}

void describe_uncertainty(const Adjustment& a, const RefineOptions& options, RefinedPoses& result) {
  JointEvidence evidence;
  result.centre = centre_of(a);
  const JointEquations joint = joint_equations(a, result.centre, &evidence);
  const Eigen::Index size = joint.right.size() - 6;
  const Eigen::MatrixXd information = joint.normal.bottomRightCorner(size, size);
  const Eigen::MatrixXd covariance = joint_covariance(information, evidence.scores) +
                                     covariance_of_pull(information, evidence.calibration_pull.bottomRows(size));
  result.covariance.push_back(Matrix6::Zero());
  for (std::size_t pose = 1; pose < a.measured.size(); ++pose) {
    const auto at = static_cast<Eigen::Index>(6 * (pose - 1));
    const Transform first_from_pose = a.model_from_pose[0].inverse() * a.model_from_pose[pose];
    const Matrix6 of_axis =
        axis_covariance(first_from_pose, a.model_from_pose[0].inverse() * result.centre, options.axis);
    Matrix6 turned = Matrix6::Zero();
    turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = a.model_from_pose[0].linear();
    result.covariance.push_back(covariance.block<6, 6>(at, at) + turned * of_axis * turned.transpose());
  }
}

bool joins_all(std::size_t poses, std::span<const PoseLink> links) {
  std::vector<bool> is_joined(poses, false);
  is_joined[0] = true;
  for (std::size_t round = 1; round < poses; ++round) {
    for (const PoseLink& link : links) {
      if (is_joined[link.pose1] || is_joined[link.pose2]) is_joined[link.pose1] = is_joined[link.pose2] = true;
    }
  }
  return std::ranges::all_of(is_joined, [](bool is) { return is; });
}

}  // namespace

Result<RefinedPoses> refine_poses(std::span<const std::span<const View>> poses,
                                  std::span<const Transform> model_from_pose, std::span<const PoseLink> links,
                                  const RefineOptions& options, const Context& context) {
  const auto is_of_two = [&](const PoseLink& link) { return link.pose1 < link.pose2 && link.pose2 < poses.size(); };
  if (poses.size() < 2 || model_from_pose.size() != poses.size() || !std::ranges::all_of(links, is_of_two) ||
      !joins_all(poses.size(), links)) {
    return fail(ErrorCode::invalid_input, "pose refinement: {} links do not join {} poses with {} starts", links.size(),
                poses.size(), model_from_pose.size());
  }
  Adjustment a{.measured = {}, .model_from_pose = {model_from_pose.begin(), model_from_pose.end()}, .ties = {}};
  for (const std::span<const View> views : poses) {
    a.measured.push_back(measured_pose(views, options.levels));
    if (a.measured.back().samples.back().size() < options.min_correspondences) {
      return fail(ErrorCode::degenerate, "pose refinement: pose {} has no measured surface", a.measured.size());
    }
    a.arm += 0.5 * a.measured.back().size_mm / static_cast<double>(poses.size());
  }
  for (const PoseLink& link : links) {
    Tie& tie = a.ties.emplace_back(
        Tie{.link = link, .options = options, .capture = std::min(options.capture_mm, 2.0 * options.capture * a.arm)});
    tie.options.contacts = link.contacts;
    tie.options.held = link.held;
  }
  RefinedPoses result;
  for (int level = options.levels - 1; level >= 0; --level) {
    if (context.stopped()) return fail(ErrorCode::stopped, "pose refinement: stopped");
    const auto steps = refine_level(a, level, options);
    if (!steps) return pass_on(steps);
    result.iterations += *steps;
    for (Tie& tie : a.ties) {
      tie.capture = std::min(tie.capture, std::max(options.capture_medians * quantile(distances_found(tie.found), 0.5),
                                                   2.0 * options.min_capture * a.arm));
    }
    context.report("refine", 1.0 - static_cast<double>(level) / options.levels);
  }
  if (auto ok = check_links(a, 0, options); !ok) return pass_on(ok);
  result.model_from_pose = a.model_from_pose;
  describe_fit(a, result);
  describe_uncertainty(a, options, result);
  return result;
}

}  // namespace scanrig
