#include "pipeline/calibration/watch/rig_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/statistics.h"
#include "core/units.h"

namespace scanrig {
namespace {

constexpr int kRounds = 6;
constexpr double kAngleSigmaDeg = 0.01;  // of each view, beside the common offset
constexpr double kOffsetSigmaDeg = 1.0;  // of the table's zero
constexpr double kCommonDotPx = 0.006;   // of all dots of an image: light, wobble; more dots do not average it
constexpr double kCommonRowPx = 0.003;   // the same of a view's rows
constexpr double kFirstDotPx = 0.5;      // of a dot while nothing is known
constexpr double kMinDotPx = 0.01;

/// Unknowns: 12 of the poses, the common angle, then one angle per view.
constexpr int kOffset = 12, kAngles = 13;

/// One measured coordinate: its departure from the prediction, derivative by its two groups of unknowns.
struct Equation {
  double miss = 0.0;
  double variance = 1.0;
  PoseChange by_pose = PoseChange::Zero();
  double by_angle = 0.0;
  int view = 0;
};

class Fitter {
 public:
  Fitter(const WatchInput& input, const PoseMatrix& prior)
      : input_(input), information_(prior.inverse()), angles_(input.views.size(), 0.0) {
    const auto& quality = input.calibration.quality;
    gear_ = quality ? quality->gear : 1.0;
  }
  RigFit fit();

 private:
  void add_dots(std::size_t view, int camera, const Calibration& now, std::vector<Equation>& out) const;
  void add_rows(std::size_t view, const Calibration& now, std::vector<Equation>& out) const;
  [[nodiscard]] std::vector<Equation> equations(const Calibration& now) const;
  void update_dot_sigma(const std::vector<Equation>& all);
  void assemble(const std::vector<Equation>& all);
  void step();
  [[nodiscard]] double reported(std::size_t view) const { return gear_ * input_.views[view].angle_rad; }
  void finish(RigFit& fit) const;

  const WatchInput& input_;
  PoseMatrix information_;
  double gear_ = 1.0;
  PoseChange change_ = PoseChange::Zero();
  double offset_ = 0.0;
  std::vector<double> angles_;  // true minus reported
  Eigen::Vector2d dot_sigma_{kFirstDotPx, kFirstDotPx};
  Eigen::MatrixXd normal_;  // of the data and the angles' priors
  Eigen::VectorXd right_;
};

void Fitter::add_dots(std::size_t view, int camera, const Calibration& now, std::vector<Equation>& out) const {
  const auto& seen = input_.views[view].dots[static_cast<std::size_t>(camera)];
  const auto& places = input_.calibration.quality->rim_dots;
  const Camera& eye = camera == 0 ? now.left : now.right;
  const double common = static_cast<double>(seen.size()) * kCommonDotPx * kCommonDotPx;
  const Transform turned = rot_y(reported(view) + angles_[view]);
  for (const DotObservation& dot : seen) {
    if (dot.id < 0 || dot.id >= static_cast<int>(places.size())) continue;
    const Eigen::Vector3d point = turned * places[static_cast<std::size_t>(dot.id)];
    const Eigen::Vector2d miss = dot.pixel - eye.project(point);
    const Eigen::Vector2d by_angle = pixel_by_point(eye, point) * Eigen::Vector3d::UnitY().cross(point);
    const PixelByPose by_pose = pixel_by_pose(eye, point);
    for (int axis = 0; axis < 2; ++axis) {
      const double sigma = dot_sigma_[axis], far = miss[axis] / (3.0 * sigma);
      Equation e{miss[axis], (sigma * sigma + common) * (1.0 + far * far), PoseChange::Zero(), by_angle[axis],
                 static_cast<int>(view)};
      e.by_pose.segment<6>(6 * camera) = by_pose.row(axis).transpose();
      out.push_back(e);
    }
  }
}

/// Rows in the rectified frame: focal * y / z of the direction in which a camera shows the point. The frame is the
/// calibration's, so it turns with the camera.
void Fitter::add_rows(std::size_t view, const Calibration& now, std::vector<Equation>& out) const {
  const auto& rows = input_.views[view].rows;
  const double common = static_cast<double>(rows.size()) * kCommonRowPx * kCommonRowPx;
  for (const RowSighting& row : rows) {
    Equation e{row.offset_px, row.sigma_px * row.sigma_px + common, PoseChange::Zero(), 0.0, static_cast<int>(view)};
    for (int c = 0; c < 2; ++c) {
      const Camera& was = c == 0 ? input_.calibration.left : input_.calibration.right;
      const Camera& is = c == 0 ? now.left : now.right;
      const Eigen::Matrix3d rectify = input_.rectified_from_turntable * was.camera_from_turntable.linear().transpose();
      const Eigen::Vector3d seen = rectify * (is.camera_from_turntable * row.point);
      const double sign = c == 0 ? -1.0 : 1.0;
      e.miss -= sign * input_.rectified_focal_px * seen.y() / seen.z();
      const Eigen::RowVector3d by_seen =
          sign * input_.rectified_focal_px / seen.z() * Eigen::RowVector3d(0.0, 1.0, -seen.y() / seen.z());
      const Eigen::RowVector3d by_camera_point = by_seen * rectify;
      const Eigen::Vector3d turned = is.camera_from_turntable.linear() * row.point;
      e.by_pose.segment<3>(6 * c) = turned.cross(by_camera_point.transpose());
      e.by_pose.segment<3>(6 * c + 3) = by_camera_point.transpose();
    }
    out.push_back(e);
  }
}

std::vector<Equation> Fitter::equations(const Calibration& now) const {
  std::vector<Equation> all;
  for (std::size_t view = 0; view < input_.views.size(); ++view) {
    add_dots(view, 0, now, all);
    add_dots(view, 1, now, all);
    add_rows(view, now, all);
  }
  return all;
}

/// By the median of what the fit leaves; dots are equations in pairs, x then y.
void Fitter::update_dot_sigma(const std::vector<Equation>& all) {
  std::array<std::vector<double>, 2> misses;
  int axis = 0;
  for (const Equation& e : all) {
    if (e.by_angle == 0.0) continue;
    misses[static_cast<std::size_t>(axis)].push_back(std::abs(e.miss));
    axis = 1 - axis;
  }
  for (int i = 0; i < 2; ++i) {
    const auto& of_axis = misses[static_cast<std::size_t>(i)];
    if (!of_axis.empty()) dot_sigma_[i] = std::max(kMinDotPx, 1.4826 * quantile(of_axis, 0.5));
  }
}

void Fitter::assemble(const std::vector<Equation>& all) {
  const auto size = kAngles + static_cast<Eigen::Index>(angles_.size());
  normal_ = Eigen::MatrixXd::Zero(size, size);
  right_ = Eigen::VectorXd::Zero(size);
  for (const Equation& e : all) {
    const double weight = 1.0 / e.variance;
    const Eigen::Index angle = kAngles + e.view;
    normal_.topLeftCorner<12, 12>() += weight * e.by_pose * e.by_pose.transpose();
    normal_.block<12, 1>(0, angle) += weight * e.by_angle * e.by_pose;
    normal_.block<1, 12>(angle, 0) += weight * e.by_angle * e.by_pose.transpose();
    normal_(angle, angle) += weight * e.by_angle * e.by_angle;
    right_.head<12>() += weight * e.miss * e.by_pose;
    right_[angle] += weight * e.miss * e.by_angle;
  }
  const double own = 1.0 / std::pow(to_radians(kAngleSigmaDeg), 2);
  const double common = 1.0 / std::pow(to_radians(kOffsetSigmaDeg), 2);
  normal_(kOffset, kOffset) += common;
  right_[kOffset] -= common * offset_;
  for (std::size_t view = 0; view < angles_.size(); ++view) {
    const auto angle = kAngles + static_cast<Eigen::Index>(view);
    const double apart = angles_[view] - offset_;
    normal_(angle, angle) += own;
    normal_(kOffset, kOffset) += own;
    normal_(angle, kOffset) -= own;
    normal_(kOffset, angle) -= own;
    right_[angle] -= own * apart;
    right_[kOffset] += own * apart;
  }
}

void Fitter::step() {
  Eigen::MatrixXd normal = normal_;
  Eigen::VectorXd right = right_;
  normal.topLeftCorner<12, 12>() += information_;
  right.head<12>() -= information_ * change_;
  // Radians and millimetres differ by orders of magnitude.
  const Eigen::VectorXd unit = normal.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd delta = unit.asDiagonal() * Eigen::MatrixXd(unit.asDiagonal() * normal * unit.asDiagonal())
                                                        .ldlt()
                                                        .solve(Eigen::VectorXd(unit.asDiagonal() * right));
  change_ += delta.head<12>();
  offset_ += delta[kOffset];
  for (std::size_t view = 0; view < angles_.size(); ++view) {
    angles_[view] += delta[kAngles + static_cast<Eigen::Index>(view)];
  }
}

void Fitter::finish(RigFit& fit) const {
  fit.change = change_;
  const Eigen::Index rest = normal_.rows() - kOffset;
  const Eigen::MatrixXd across = normal_.topRightCorner(12, rest);
  const auto solver = Eigen::MatrixXd(normal_.bottomRightCorner(rest, rest)).ldlt();
  fit.normal = normal_.topLeftCorner<12, 12>() - across * solver.solve(across.transpose());
  fit.normal = (0.5 * (fit.normal + fit.normal.transpose())).eval();
  fit.right = right_.head<12>() - across * solver.solve(right_.tail(rest)) + fit.normal * change_;
  fit.angle_offset_rad = offset_;
  double squares = 0.0;
  double rows = 0.0;
  for (std::size_t view = 0; view < angles_.size(); ++view) {
    fit.angles_rad.push_back(reported(view) + angles_[view]);
    squares += std::pow(angles_[view] - offset_, 2);
    for (std::size_t c = 0; c < 2; ++c) fit.dots[c] += static_cast<int>(input_.views[view].dots[c].size());
    for (const RowSighting& row : input_.views[view].rows) rows += row.offset_px * row.offset_px;
    fit.rows += static_cast<int>(input_.views[view].rows.size());
  }
  fit.angle_rms_rad = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, angles_.size())));
  fit.rows_rms_px = fit.rows > 0 ? std::sqrt(rows / fit.rows) : 0.0;
  fit.dot_sigma_px = dot_sigma_;
}

RigFit Fitter::fit() {
  for (int round = 0; round < kRounds; ++round) {
    assemble(equations(moved(input_.calibration, change_)));
    step();
    update_dot_sigma(equations(moved(input_.calibration, change_)));
  }
  assemble(equations(moved(input_.calibration, change_)));
  RigFit result;
  finish(result);
  return result;
}

}  // namespace

RigFit fit_rig(const WatchInput& input, const PoseMatrix& prior) { return Fitter(input, prior).fit(); }

}  // namespace scanrig
