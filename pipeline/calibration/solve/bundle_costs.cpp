#include "pipeline/calibration/solve/bundle_costs.h"

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/QR>
#include <algorithm>

#include "pipeline/calibration/solve/sighting_model.h"

namespace scanrig {
namespace {

template <int N>
using RowMajor = Eigen::Matrix<double, 2, N, Eigen::RowMajor>;

template <int N>
void write(double* to, const Eigen::Matrix<double, 2, N>& derivative, double weight) {
  if (to) Eigen::Map<RowMajor<N>>(to, 2, N) = weight * derivative;
}

/// A pose has seven values and six directions: a derivative's seventh column is zero, which the manifold leaves out.
void write_pose(double* to, const Eigen::Matrix<double, 2, 6>& by_pose, double weight) {
  if (!to) return;
  Eigen::Map<RowMajor<7>> out(to);
  out.leftCols<6>() = weight * by_pose;
  out.col(6).setZero();
}

class SightingCost : public ceres::CostFunction {
 public:
  SightingCost(const Eigen::Vector2d& pixel, const LensFieldSupport* field, double sigma)
      : pixel_(pixel), weight_(1.0 / sigma), has_field_(field != nullptr) {
    set_num_residuals(2);
    if (field) field_ = *field;
  }

 protected:
  void finish_blocks(std::initializer_list<int> sizes) {
    mutable_parameter_block_sizes()->assign(sizes.begin(), sizes.end());
    first_field_ = sizes.size();
    if (has_field_) mutable_parameter_block_sizes()->insert(mutable_parameter_block_sizes()->end(), 16, 2);
  }
  /// The field acts at the measured pixel: it is smooth, and so linear in its coefficients.
  void finish(const Eigen::Vector2d& lens_pixel, double const* const* blocks, double* residuals,
              double** jacobians) const {
    Eigen::Vector2d model = lens_pixel;
    for (std::size_t k = 0; has_field_ && k < 16; ++k) {
      const double w = field_.down[k / 4] * field_.across[k % 4];
      const double* c = blocks[first_field_ + k];
      model += w * Eigen::Vector2d(c[0], c[1]);
      if (jacobians) write<2>(jacobians[first_field_ + k], w * Eigen::Matrix2d::Identity(), weight_);
    }
    residuals[0] = weight_ * (model.x() - pixel_.x());
    residuals[1] = weight_ * (model.y() - pixel_.y());
  }
  [[nodiscard]] double weight() const { return weight_; }

 private:
  Eigen::Vector2d pixel_;
  double weight_;
  bool has_field_;
  LensFieldSupport field_;
  std::size_t first_field_ = 0;
};

class CornerCost final : public SightingCost {
 public:
  CornerCost(const Eigen::Vector2d& pixel, const Eigen::Vector2d& place, const Eigen::Vector2d& share,
             const LensFieldSupport* field, double sigma)
      : SightingCost(pixel, field, sigma), place_(place), share_(share) {
    finish_blocks({9, 7, 6, 7, 6, 3});
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    PixelJacobians found;
    const Eigen::Vector2d pixel =
        corner_pixel(b[0], b[1], b[2], b[3], b[4], b[5], place_, share_, j ? &found : nullptr);
    finish(pixel, b, residuals, j);
    if (!j) return true;
    write<9>(j[0], found.lens, weight());
    write_pose(j[1], found.camera, weight());
    write<6>(j[2], found.motion, weight());
    write_pose(j[3], found.placement, weight());
    write<6>(j[4], found.shape, weight());
    write<3>(j[5], found.point, weight());
    return true;
  }

 private:
  Eigen::Vector2d place_, share_;
};

class DotCost final : public SightingCost {
 public:
  DotCost(const Eigen::Vector2d& pixel, const LensFieldSupport* field, double sigma)
      : SightingCost(pixel, field, sigma) {
    finish_blocks({9, 7, 6, 3});
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    PixelJacobians found;
    Eigen::Matrix<double, 2, 3> by_point;
    const Eigen::Vector3d dot(b[3][0], b[3][1], b[3][2]);
    finish(table_pixel(b[0], b[1], b[2], dot, j ? &found : nullptr, &by_point), b, residuals, j);
    if (!j) return true;
    write<9>(j[0], found.lens, weight());
    write_pose(j[1], found.camera, weight());
    write<6>(j[2], found.motion, weight());
    write<3>(j[3], by_point, weight());
    return true;
  }
};

class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(const std::vector<double>& mean, const std::vector<double>& sigma) : mean_(mean), sigma_(sigma) {
    set_num_residuals(static_cast<int>(mean.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(mean.size()));
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    const std::size_t n = mean_.size();
    for (std::size_t i = 0; i < n; ++i) residuals[i] = (b[0][i] - mean_[i]) / sigma_[i];
    if (!j || !j[0]) return true;
    std::fill_n(j[0], n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) j[0][i * n + i] = 1.0 / sigma_[i];
    return true;
  }

 private:
  std::vector<double> mean_, sigma_;
};

class MotionCost final : public ceres::CostFunction {
 public:
  MotionCost(double reported, double angle, double tilt, double shift)
      : reported_(reported), sigma_{angle, tilt, tilt, shift, shift, shift} {
    set_num_residuals(6);
    *mutable_parameter_block_sizes() = {6, 1};
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    for (std::size_t i = 0; i < 6; ++i) {
      residuals[i] = (b[0][i] - (i == 0 ? b[1][0] * reported_ : 0.0)) / sigma_[i];
      if (j && j[0]) {
        for (std::size_t k = 0; k < 6; ++k) j[0][6 * i + k] = i == k ? 1.0 / sigma_[i] : 0.0;
      }
      if (j && j[1]) j[1][i] = i == 0 ? -reported_ / sigma_[0] : 0.0;
    }
    return true;
  }

 private:
  double reported_;
  std::array<double, 6> sigma_;
};

class AzimuthCost final : public ceres::CostFunction {
 public:
  AzimuthCost(int cameras, double sigma) : share_(1.0 / (sigma * cameras)), cameras_(cameras) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(cameras), 7);
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    residuals[0] = 0.0;
    for (int camera = 0; camera < cameras_; ++camera) {
      PoseBlock block{};
      std::copy_n(b[camera], 7, block.begin());
      const Transform pose = to_transform(block);
      const Eigen::Vector3d across = pose.linear().col(0);  // the table's x axis, in the camera frame
      residuals[0] -= share_ * across.dot(pose.translation());
      if (!j || !j[camera]) continue;
      Eigen::Map<Eigen::Matrix<double, 1, 7>> out(j[camera]);
      out.head<3>() = share_ * pose.translation().cross(across).transpose();
      out.segment<3>(3) = -share_ * across.transpose();
      out[6] = 0.0;
    }
    return true;
  }

 private:
  double share_;
  int cameras_;
};

class HeightCost final : public ceres::CostFunction {
 public:
  HeightCost(double height, double sigma) : height_(height), weight_(1.0 / sigma) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(7);
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    residuals[0] = weight_ * (b[0][5] - height_);
    if (!j || !j[0]) return true;
    std::fill_n(j[0], 7, 0.0);
    j[0][4] = weight_;  // the second of the shift's three directions
    return true;
  }

 private:
  double height_, weight_;
};

/// Orthonormal common motions of all corners, 12 rows.
Eigen::MatrixXd common_modes(const Board& board) {
  const int n = board.corner_count();
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(3 * n, 12);
  for (int id = 0; id < n; ++id) {
    const Eigen::Vector2d p = corner_share(board, id), q = ordered_corner(board, id);
    modes.block<3, 12>(3 * id, 0) << 1.0, 0.0, -q.y(), q.x(), q.x(), q.y(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,  //
        0.0, 1.0, q.x(), q.y(), -q.y(), q.x(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,                               //
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y();
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(modes);
  return (qr.householderQ() * Eigen::MatrixXd::Identity(3 * n, 12)).transpose();
}

class OffsetModesCost final : public ceres::CostFunction {
 public:
  OffsetModesCost(const Board& board, double sigma) : rows_(common_modes(board) / sigma) {
    set_num_residuals(12);
    mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(board.corner_count()), 3);
  }
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    Eigen::Map<Eigen::Matrix<double, 12, 1>> out(residuals);
    out.setZero();
    for (int id = 0; 3 * id < rows_.cols(); ++id) {
      const auto part = rows_.middleCols<3>(3 * id);
      out += part * Eigen::Map<const Eigen::Vector3d>(b[id]);
      if (j && j[id]) Eigen::Map<Eigen::Matrix<double, 12, 3, Eigen::RowMajor>>(j[id], 12, 3) = part;
    }
    return true;
  }

 private:
  Eigen::MatrixXd rows_;
};

class LengthCost final : public ceres::SizedCostFunction<1, 6, 3, 3> {
 public:
  LengthCost(const Board& board, const MeasuredLength& length) : board_(board), length_(length) {}
  bool Evaluate(double const* const* b, double* residuals, double** j) const override {
    std::array<Eigen::Matrix<double, 3, 6>, 2> by_shape;
    std::array<Eigen::Vector3d, 2> ends;
    for (std::size_t i = 0; i < 2; ++i) {
      const int id = (*length_.corners)[i];
      ends[i] = corner_in_board(b[0], b[i + 1], ordered_corner(board_, id), corner_share(board_, id), &by_shape[i]);
    }
    const Eigen::Vector3d apart = ends[1] - ends[0];
    const Eigen::RowVector3d along = apart.transpose() / (apart.norm() * length_.sigma_mm);
    residuals[0] = (apart.norm() - length_.measured_mm) / length_.sigma_mm;
    if (!j) return true;
    if (j[0]) Eigen::Map<Eigen::Matrix<double, 1, 6>>(j[0], 1, 6) = along * (by_shape[1] - by_shape[0]);
    if (j[1]) Eigen::Map<Eigen::RowVector3d>(j[1], 3) = -along;
    if (j[2]) Eigen::Map<Eigen::RowVector3d>(j[2], 3) = along;
    return true;
  }

 private:
  Board board_;
  MeasuredLength length_;
};

class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    const Eigen::Vector3d rotation(delta[0], delta[1], delta[2]);
    const double angle = rotation.norm();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(
        angle, angle > 0.0 ? Eigen::Vector3d(rotation / angle) : Eigen::Vector3d(Eigen::Vector3d::UnitX())));
    const Eigen::Quaterniond q = (turn * Eigen::Quaterniond(x[0], x[1], x[2], x[3])).normalized();
    const std::array<double, 7> sum{q.w(), q.x(), q.y(), q.z(), x[4] + delta[3], x[5] + delta[4], x[6] + delta[5]};
    std::copy(sum.begin(), sum.end(), out);
    return true;
  }
  /// The costs write their derivatives by the six directions into the first six columns.
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    const Eigen::Quaterniond a(y[0], y[1], y[2], y[3]), b(x[0], x[1], x[2], x[3]);
    const Eigen::AngleAxisd turn(a * b.conjugate());
    Eigen::Map<Eigen::Vector3d>(out, 3) = turn.angle() * turn.axis();
    for (int i = 0; i < 3; ++i) out[3 + i] = y[4 + i] - x[4 + i];
    return true;
  }
  bool MinusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

}  // namespace

ceres::CostFunction* corner_cost(const Eigen::Vector2d& pixel, const Eigen::Vector2d& place,
                                 const Eigen::Vector2d& share, const LensFieldSupport* field, double sigma) {
  return new CornerCost(pixel, place, share, field, sigma);
}
ceres::CostFunction* dot_cost(const Eigen::Vector2d& pixel, const LensFieldSupport* field, double sigma) {
  return new DotCost(pixel, field, sigma);
}
ceres::CostFunction* prior_cost(const std::vector<double>& mean, const std::vector<double>& sigma) {
  return new PriorCost(mean, sigma);
}
ceres::CostFunction* motion_cost(double reported_rad, double angle_sigma, double tilt_sigma, double shift_sigma) {
  return new MotionCost(reported_rad, angle_sigma, tilt_sigma, shift_sigma);
}
ceres::CostFunction* azimuth_cost(int cameras, double sigma) { return new AzimuthCost(cameras, sigma); }
ceres::CostFunction* height_cost(double height, double sigma) { return new HeightCost(height, sigma); }
ceres::CostFunction* offset_modes_cost(const Board& board, double sigma) { return new OffsetModesCost(board, sigma); }
ceres::CostFunction* length_cost(const Board& board, const MeasuredLength& length) {
  return new LengthCost(board, length);
}
ceres::Manifold* pose_manifold() { return new PoseManifold; }

}  // namespace scanrig
