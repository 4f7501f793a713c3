#include "pipeline/calibration/solve/volume_error.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.h"
#include "pipeline/calibration/solve/sighting_model.h"

namespace scanrig {
namespace {

using TwoPixels = Eigen::Matrix<double, 4, 3>;

/// The least-squares inverse of the derivative of both pixels by the point.
Eigen::Matrix<double, 3, 4> inverse_of(const TwoPixels& by_point) {
  return (by_point.transpose() * by_point).inverse() * by_point.transpose();
}

Eigen::Matrix<double, 7, 3> modes_at(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 7, 3> modes;
  modes << 1.0, 0.0, 0.0,   // shift x
      0.0, 0.0, 1.0,        // shift z
      0.0, -p.z(), p.y(),   // tilt about x
      -p.y(), p.x(), 0.0,   // tilt about z
      p.z(), 0.0, -p.x(),   // turn about y
      p.x(), p.y(), p.z(),  // scale
      0.0, 1.0, 0.0;        // shift y
  return modes;
}

/// Derivatives of one camera's pixel by its unknowns, into the rows of the unknowns, times `moves` (point by pixel).
void add_camera(const CalibrationInput& input, const CameraUnknowns& camera, const Linearised& linear, std::size_t c,
                const Eigen::Vector3d& point, const Eigen::Matrix<double, 3, 2>& moves,
                Eigen::Ref<Eigen::MatrixXd> out) {
  const std::array<double, 6> still{};
  PixelJacobians by;
  Eigen::Matrix<double, 2, 3> by_point;
  const Eigen::Vector2d pixel =
      table_pixel(camera.lens.data(), camera.camera_from_table.data(), still.data(), point, &by, &by_point);
  if (linear.lens[c].count == 9) out.middleRows<9>(linear.lens[c].first) = -(moves * by.lens).transpose();
  if (linear.pose[c].count == 6) out.middleRows<6>(linear.pose[c].first) = -(moves * by.camera).transpose();
  if (linear.field[c].count != 2 * LensField::kCount) return;
  const LensFieldSupport f = LensField::support(pixel, input.width, input.height);
  for (int k = 0; k < 16; ++k) {
    const double w = f.down[static_cast<std::size_t>(k / 4)] * f.across[static_cast<std::size_t>(k % 4)];
    const int row = linear.field[c].first + 2 * (f.first + k % 4 + LensField::kColumns * (k / 4));
    out.middleRows<2>(row) = -w * moves.transpose();
  }
}

bool is_seen(const Camera& camera, const Eigen::Vector3d& point) {
  return (camera.camera_from_turntable * point).z() > 1.0 && camera.projection.contains(camera.project(point));
}

}  // namespace

std::vector<Eigen::Vector3d> volume_grid(const Calibration& calibration, const CalibrationVolume& volume) {
  std::vector<Eigen::Vector3d> grid;
  constexpr int kLevels = 6, kRings = 3;
  for (int level = 0; level < kLevels; ++level) {
    const double y = volume.min_height_mm + (volume.max_height_mm - volume.min_height_mm) * level / (kLevels - 1);
    for (int ring = 0; ring <= kRings; ++ring) {
      const int steps = ring == 0 ? 1 : 6 * ring;
      const double radius = volume.radius_mm * ring / kRings;
      for (int step = 0; step < steps; ++step) {
        const double angle = 2.0 * std::numbers::pi * step / steps;
        const Eigen::Vector3d point(radius * std::cos(angle), y, radius * std::sin(angle));
        if (is_seen(calibration.left, point) && is_seen(calibration.right, point)) grid.push_back(point);
      }
    }
  }
  return grid;
}

Eigen::Vector3d triangulate(const Calibration& calibration, const Eigen::Vector2d& left, const Eigen::Vector2d& right,
                            const Eigen::Vector3d& start) {
  Eigen::Vector3d point = start;
  for (int round = 0; round < 10; ++round) {
    TwoPixels by_point;
    Eigen::Vector4d miss;
    for (int c = 0; c < 2; ++c) {
      const Camera& camera = c == 0 ? calibration.left : calibration.right;
      Eigen::Matrix<double, 2, 3> by;
      lens_pixel(lens_block(camera).data(), camera.camera_from_turntable * point, nullptr, &by);
      by_point.middleRows<2>(2 * c) = by * camera.camera_from_turntable.linear();
      miss.segment<2>(2 * c) = (c == 0 ? left : right) - camera.project(point);
    }
    const Eigen::Vector3d step = inverse_of(by_point) * miss;
    point += step;
    if (step.squaredNorm() < 1e-20) break;
  }
  return point;
}

Eigen::MatrixXd volume_response(const CalibrationInput& input, const Unknowns& unknowns, const Linearised& linear,
                                const std::vector<Eigen::Vector3d>& grid) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(linear.columns, 3 * static_cast<Eigen::Index>(grid.size()));
  for (std::size_t i = 0; i < grid.size(); ++i) {
    TwoPixels by_point;
    for (std::size_t c = 0; c < 2; ++c) {
      const Transform pose = to_transform(unknowns.cameras[c].camera_from_table);
      Eigen::Matrix<double, 2, 3> by;
      lens_pixel(unknowns.cameras[c].lens.data(), pose * grid[i], nullptr, &by);
      by_point.middleRows<2>(2 * static_cast<Eigen::Index>(c)) = by * pose.linear();
    }
    const Eigen::Matrix<double, 3, 4> moves = inverse_of(by_point);
    for (std::size_t c = 0; c < 2; ++c) {
      add_camera(input, unknowns.cameras[c], linear, c, grid[i], moves.middleCols<2>(2 * static_cast<Eigen::Index>(c)),
                 out.middleCols<3>(3 * static_cast<Eigen::Index>(i)));
    }
  }
  return out;
}

VolumeParts::VolumeParts(const std::vector<Eigen::Vector3d>& grid)
    : grid_(grid), modes_(3 * static_cast<Eigen::Index>(grid.size()), 7) {
  for (std::size_t i = 0; i < grid.size(); ++i) {
    modes_.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = modes_at(grid[i]).transpose();
  }
  fitted_ = (modes_.transpose() * modes_).ldlt().solve(modes_.transpose());
}

VolumeParts::Split VolumeParts::split(const Eigen::MatrixXd& half) const {
  const Eigen::MatrixXd fits = half * fitted_.transpose();  // one column per mode
  const auto part = [&](int first, int count) -> Eigen::MatrixXd {
    return fits.middleCols(first, count) * modes_.middleCols(first, count).transpose();
  };
  return {.axis = part(0, 4),
          .azimuth = part(4, 1),
          .scale = part(5, 1),
          .base = part(6, 1),
          .strain = half - part(0, 7),
          .volume = half - part(5, 2)};
}

VolumeSigma VolumeParts::sigma(const Eigen::MatrixXd& half) const {
  const auto rms = [](const Eigen::MatrixXd& part) {
    return kMicrometresPerMm * std::sqrt(part.squaredNorm() / (static_cast<double>(part.cols()) / 3.0));
  };
  const Split parts = split(half);
  VolumeSigma sigma{.axis = rms(parts.axis),
                    .strain = rms(parts.strain),
                    .azimuth = rms(parts.azimuth),
                    .scale = rms(parts.scale),
                    .base = rms(parts.base),
                    .volume = rms(parts.volume)};
  for (Eigen::Index i = 0; i + 2 < parts.volume.cols(); i += 3) {
    sigma.max = std::max(sigma.max, kMicrometresPerMm * parts.volume.middleCols<3>(i).norm());
  }
  return sigma;
}

std::vector<PointSigma> VolumeParts::sigma_at(const Eigen::MatrixXd& half) const {
  const Split parts = split(half);
  std::vector<PointSigma> found;
  for (std::size_t i = 0; i < grid_.size(); ++i) {
    const auto norm = [&](const Eigen::MatrixXd& part) {
      return kMicrometresPerMm * part.middleCols<3>(3 * static_cast<Eigen::Index>(i)).norm();
    };
    found.push_back({.point = grid_[i],
                     .axis = norm(parts.axis),
                     .strain = norm(parts.strain),
                     .azimuth = norm(parts.azimuth),
                     .scale = norm(parts.scale),
                     .base = norm(parts.base),
                     .volume = norm(parts.volume)});
  }
  return found;
}

Eigen::VectorXd VolumeParts::coefficients(const Eigen::VectorXd& field) const { return fitted_ * field; }

Eigen::VectorXd VolumeParts::without_scale_and_base(const Eigen::VectorXd& field) const {
  return field - modes_.rightCols<2>() * (fitted_ * field).tail<2>();
}

double rms_per_point(const Eigen::VectorXd& field) {
  return std::sqrt(field.squaredNorm() / (static_cast<double>(field.size()) / 3.0));
}

double max_per_point(const Eigen::VectorXd& field) {
  double greatest = 0.0;
  for (Eigen::Index i = 0; i + 2 < field.size(); i += 3) greatest = std::max(greatest, field.segment<3>(i).norm());
  return greatest;
}

Eigen::VectorXd volume_difference(const Calibration& reference, const Calibration& other,
                                  const std::vector<Eigen::Vector3d>& grid) {
  Eigen::VectorXd field(3 * static_cast<Eigen::Index>(grid.size()));
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const Eigen::Vector3d found =
        triangulate(other, reference.left.project(grid[i]), reference.right.project(grid[i]), grid[i]);
    field.segment<3>(3 * static_cast<Eigen::Index>(i)) = found - grid[i];
  }
  return field;
}

}  // namespace scanrig
