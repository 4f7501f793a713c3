#include "sim/scene/lens_residual.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <numbers>

#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

constexpr int kTerms = LensResidual::kTerms;
constexpr int kUnknowns = 2 * kTerms * kTerms;
constexpr int kAcross = 33, kDown = 25;  // nodes over the image
constexpr int kModel = 12;

using Amplitudes = Eigen::Matrix<double, kUnknowns, 1>;

LensResidual residual_of(const Amplitudes& a) {
  LensResidual field;
  field.du = Eigen::Map<const Eigen::Matrix4d>(a.data());
  field.dv = Eigen::Map<const Eigen::Matrix4d>(a.data() + kTerms * kTerms);
  return field;
}

/// Displacements of the pixel (u, v) by each of the model's own parameters, any scale: columns.
Eigen::Matrix<double, 2, kModel> model_at(const Eye& eye, double u, double v) {
  const double x = (u - eye.cx) / eye.fx, y = (v - eye.cy) / eye.fy, r2 = x * x + y * y;
  Eigen::Matrix<double, 2, kModel> m;
  m.row(0) << 1, 0, x, 0, -y, 1 + x * x, x * y, x * r2, x * r2 * r2, 2 * x * y, r2 + 2 * x * x, x * r2 * r2 * r2;
  m.row(1) << 0, 1, 0, y, x, x * y, 1 + y * y, y * r2, y * r2 * r2, r2 + 2 * y * y, 2 * x * y, y * r2 * r2 * r2;
  return m;
}

}  // namespace

LensResidual draw_lens_residual(const Eye& eye, double rms_px, std::uint64_t seed) {
  Amplitudes drawn;
  for (int i = 0; i < kUnknowns; ++i) drawn[i] = normal(mix(seed, i));
  // Fields at the nodes: of each amplitude alone, and of the model's parameters.
  constexpr int kRows = 2 * kAcross * kDown;
  Eigen::MatrixXd fields(kRows, kUnknowns), model(kRows, kModel);
  for (int node = 0; node < kAcross * kDown; ++node) {
    const int column = node % kAcross, row = node / kAcross;
    const double x = (column + 0.5) / kAcross, y = (row + 0.5) / kDown;
    model.middleRows<2>(2 * node) = model_at(eye, x * eye.width - 0.5, y * eye.height - 0.5);
    for (int i = 0; i < kUnknowns; ++i) {
      fields.col(i).segment<2>(2 * node) = residual_of(Amplitudes::Unit(i)).at(x, y);
    }
  }
  // Amplitudes whose field is at right angles to the model's: the null space of `constraints`.
  model.colwise().normalize();
  const Eigen::MatrixXd constraints = model.transpose() * fields;
  const Amplitudes taken = constraints.completeOrthogonalDecomposition().solve(constraints * drawn);
  const Amplitudes left = drawn - taken;
  const double rms = (fields * left).norm() / std::sqrt(static_cast<double>(kAcross * kDown));
  return residual_of(left * (rms_px / rms));
}

}  // namespace scanrig::sim
