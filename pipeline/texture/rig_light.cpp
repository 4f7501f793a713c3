#include "pipeline/texture/rig_light.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr double kMetre = 1000.0;
constexpr int kLightRounds = 8;
/// Pull towards uniform light, as a share of the data's own weight: decides only what the data leave open.
constexpr double kRidge = 1e-3;
/// Relative residual at which an observation (a highlight, a cast shadow) has half its weight.
constexpr double kOutlier = 0.05;
constexpr double kDarkest = 0.2;

double lit(const RigLight::Terms& coefficients, const LightSample& s) {
  return std::max(kDarkest, coefficients.dot(RigLight::terms(s.normal, s.point)));
}

/// Adds one spot to the normal equations of coefficients 1.. (coefficient 0 is 1), the paint taken from the last round.
void add_spot(const std::vector<LightSample>& spot, int channel, const RigLight::Terms& last, Eigen::MatrixXd& normal,
              Eigen::VectorXd& right) {
  constexpr int n = RigLight::kTerms - 1;
  double weights = 0.0;
  double paint = 0.0;
  for (const auto& s : spot) {
    paint += s.weight * s.bgr[channel] / lit(last, s);
    weights += s.weight;
  }
  if (paint <= 0.0) return;
  paint /= weights;

  // With l_i the light and b_i the brightness, the best fitting paint for the given light cancels out of b_i / paint -
  // l_i, up to its weighted mean: project the mean away so that only ratios between observations count.
  struct Row {
    Eigen::Matrix<double, n, 1> terms;
    double rest, weight;
  };
  std::vector<Row> rows;
  Row mean{Eigen::Matrix<double, n, 1>::Zero(), 0.0, 0.0};
  for (const auto& s : spot) {
    const RigLight::Terms t = RigLight::terms(s.normal, s.point);
    const double relative = s.bgr[channel] / paint;
    const double light = lit(last, s);
    const double residual = (relative - light) / (kOutlier * light);
    const double w = s.weight / (1.0 + residual * residual);
    // log(b) = log(paint) + log(light), the logarithm of the light linearised at the last round.
    Row row{t.tail<n>() / light, std::log(relative / light), w};
    row.rest += row.terms.dot(last.tail<n>());
    mean.terms += w * row.terms;
    mean.rest += w * row.rest;
    mean.weight += w;
    rows.push_back(row);
  }
  for (const Row& row : rows) {
    const Eigen::Matrix<double, n, 1> terms = row.terms - mean.terms / mean.weight;
    normal.noalias() += row.weight * terms * terms.transpose();
    right.noalias() += row.weight * (row.rest - mean.rest / mean.weight) * terms;
  }
}

}  // namespace

RigLight::Terms RigLight::terms(const Eigen::Vector3d& n, const Eigen::Vector3d& p) {
  Terms t;
  t << 1.0, n.x(), n.y(), n.z(), n.x() * n.y(), n.y() * n.z(), n.z() * n.x(), n.x() * n.x() - n.z() * n.z(),
      n.y() * n.y() - 1.0 / 3.0, p.x() / kMetre, p.y() / kMetre, p.z() / kMetre;
  return t;
}

Eigen::Vector3f RigLight::at(const Eigen::Vector3d& normal, const Eigen::Vector3d& point) const {
  const Terms t = terms(normal, point);
  return Eigen::Vector3d(bgr[0].dot(t), bgr[1].dot(t), bgr[2].dot(t)).cwiseMax(kDarkest).cast<float>();
}

RigLight fit_rig_light(std::span<const std::vector<LightSample>> spots) {
  constexpr int n = RigLight::kTerms - 1;
  RigLight light;
  parallel_for(light.bgr.size(), [&](std::size_t channel) {
    RigLight::Terms& coefficients = light.bgr[channel];
    for (int round = 0; round < kLightRounds; ++round) {
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
      double weight = 0.0;
      for (const auto& spot : spots) {
        if (spot.size() < 2) continue;
        add_spot(spot, static_cast<int>(channel), coefficients, normal, right);
        for (const auto& s : spot) weight += s.weight;
      }
      if (weight <= 0.0) break;
      normal.diagonal().array() += kRidge * weight;
      coefficients.tail<n>() = normal.ldlt().solve(right);
    }
  });
  return light;
}

}  // namespace scanrig
