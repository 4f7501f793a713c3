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

double lit(const RigLight::Terms& coefficients, const RigLight::Terms& terms) {
  return std::max(kDarkest, coefficients.dot(terms));
}

/// A spot seen several times, with the terms of each observation.
struct Spot {
  std::span<const LightSample> samples;
  std::span<const RigLight::Terms> terms;
};

constexpr int kUnknown = RigLight::kTerms - 1;  // coefficient 0 is 1
using Unknowns = Eigen::Matrix<double, kUnknown, 1>;

/// Normal equations of the coefficients 1 and up. Of the matrix only the lower triangle is filled in.
struct NormalEquations {
  Eigen::Matrix<double, kUnknown, kUnknown> matrix = Eigen::Matrix<double, kUnknown, kUnknown>::Zero();
  Unknowns right = Unknowns::Zero();

  void add(const Unknowns& terms, double rest, double weight) {
    const Unknowns weighted = weight * terms;
    for (int k = 0; k < kUnknown; ++k) {
      for (int i = k; i < kUnknown; ++i) matrix(i, k) += weighted[i] * terms[k];
    }
    right += weight * rest * terms;
  }
};

/// Adds one spot, the paint taken from the last round.
void add_spot(const Spot& spot, int channel, const RigLight::Terms& last, NormalEquations& equations) {
  double weights = 0.0;
  double paint = 0.0;
  for (std::size_t i = 0; i < spot.samples.size(); ++i) {
    const LightSample& s = spot.samples[i];
    paint += s.weight * s.bgr[channel] / lit(last, spot.terms[i]);
    weights += s.weight;
  }
  if (paint <= 0.0) return;
  paint /= weights;

  // With l_i the light and b_i the brightness, the best fitting paint for the given light cancels out of b_i / paint -
  // l_i, up to its weighted mean: project the mean away so that only ratios between observations count.
  struct Row {
    Unknowns terms;
    double rest, weight;
  };
  thread_local std::vector<Row> rows;
  rows.clear();
  Row mean{Unknowns::Zero(), 0.0, 0.0};
  for (std::size_t i = 0; i < spot.samples.size(); ++i) {
    const LightSample& s = spot.samples[i];
    const RigLight::Terms& t = spot.terms[i];
    const double relative = s.bgr[channel] / paint;
    const double light = lit(last, t);
    const double residual = (relative - light) / (kOutlier * light);
    const double w = s.weight / (1.0 + residual * residual);
    // log(b) = log(paint) + log(light), the logarithm of the light linearised at the last round.
    Row row{t.tail<kUnknown>() / light, std::log(relative / light), w};
    row.rest += row.terms.dot(last.tail<kUnknown>());
    mean.terms += w * row.terms;
    mean.rest += w * row.rest;
    mean.weight += w;
    rows.push_back(row);
  }
  mean.terms /= mean.weight;
  mean.rest /= mean.weight;
  for (const Row& row : rows) equations.add(row.terms - mean.terms, row.rest - mean.rest, row.weight);
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
  std::vector<RigLight::Terms> terms;
  for (const auto& samples : spots) {
    for (const LightSample& s : samples) terms.push_back(RigLight::terms(s.normal, s.point));
  }
  std::vector<Spot> several;
  double weight = 0.0;
  for (std::size_t first = 0; const auto& samples : spots) {
    const std::span<const RigLight::Terms> here(terms.data() + first, samples.size());
    first += samples.size();
    if (samples.size() < 2) continue;
    several.push_back({samples, here});
    for (const LightSample& s : samples) weight += s.weight;
  }
  RigLight light;
  if (weight <= 0.0) return light;
  parallel_for(light.bgr.size(), [&](std::size_t channel) {
    RigLight::Terms& coefficients = light.bgr[channel];
    for (int round = 0; round < kLightRounds; ++round) {
      NormalEquations equations;
      for (const Spot& spot : several) add_spot(spot, static_cast<int>(channel), coefficients, equations);
      equations.matrix.diagonal().array() += kRidge * weight;
      const Eigen::MatrixXd matrix = equations.matrix;
      const Eigen::VectorXd right = equations.right;
      coefficients.tail<kUnknown>() = matrix.ldlt().solve(right);
    }
  });
  return light;
}

}  // namespace scanrig
