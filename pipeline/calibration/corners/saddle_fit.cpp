#include "pipeline/calibration/corners/saddle_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/calibration/corners/small_fit.h"

namespace scanrig {
namespace {

// Unknowns: place 0 1, angles of both edges 2 3, log of blur 4, slope of the light 5 6, then offset and gain per
// colour.
constexpr int kFirstSaddleColour = 7;

struct Crossing {
  double value = 0.0;  // -1 .. 1
  double by_u = 0.0;
  double by_v = 0.0;
  double by_correlation = 0.0;
};

/// Mean of sign(u + a) * sign(v + b) over standard normal a, b with correlation `c`: a blurred crossing of two edges at
/// distances u, v. The integral over the correlation is Plackett's [1954], by Gauss-Legendre.
Crossing cross(double u, double v, double c) {
  constexpr double nodes[] = {0.0337652428984240, 0.1693953067668677, 0.3806904069584015,
                              0.6193095930415985, 0.8306046932331323, 0.9662347571015760};
  constexpr double weights[] = {0.0856622461895852, 0.1803807865240693, 0.2339569672863455,
                                0.2339569672863455, 0.1803807865240693, 0.0856622461895852};
  constexpr double kRootHalf = 0.7071067811865476;
  constexpr double kInvPi2 = 2.0 / std::numbers::pi;
  const double squares = u * u + v * v;
  const double full = std::asin(c);
  double sum = 0.0;
  if (std::min(u * u, v * v) < 40.0) {
    for (int i = 0; i < 6; ++i) {
      const double angle = nodes[i] * full;
      const double cosine = std::cos(angle);
      sum += weights[i] * std::exp(-(squares - 2.0 * u * v * std::sin(angle)) / (2.0 * cosine * cosine));
    }
  }
  const double rest = std::sqrt(1.0 - c * c);
  const double density = 2.0 / std::sqrt(2.0 * std::numbers::pi);
  return {std::erf(u * kRootHalf) * std::erf(v * kRootHalf) + kInvPi2 * full * sum,
          density * std::exp(-0.5 * u * u) * std::erf((v - c * u) / rest * kRootHalf),
          density * std::exp(-0.5 * v * v) * std::erf((u - c * v) / rest * kRootHalf),
          kInvPi2 / rest * std::exp(-(squares - 2.0 * c * u * v) / (2.0 * rest * rest))};
}

/// Distances of a pixel from both edges, in sigmas.
struct Edges {
  explicit Edges(const FitVector& p)
      : along_0(std::cos(p[2]), std::sin(p[2])), along_1(std::cos(p[3]), std::sin(p[3])), blur(std::exp(p[4])) {
    turn = along_0.x() * along_1.y() - along_0.y() * along_1.x() > 0.0 ? 1.0 : -1.0;
    // u grows towards +along_1, v towards +along_0: both positive between the two directions.
    normal_0 = turn * Eigen::Vector2d(-along_0.y(), along_0.x());
    normal_1 = turn * Eigen::Vector2d(along_1.y(), -along_1.x());
    correlation = std::clamp(normal_0.dot(normal_1), -0.999, 0.999);
  }
  Eigen::Vector2d along_0, along_1, normal_0, normal_1;
  double blur;
  double turn = 1.0;
  double correlation = 0.0;
};

FitSums sums_at(const FitVector& p, std::span<const FitPixel> pixels) {
  FitSums sums(p.size());
  const Edges edges(p);
  const double inverse = 1.0 / edges.blur;
  const double correlation_by_angle = -std::sin(p[2] - p[3]);
  // d normal_0 / d angle 0 = -turn * along_0, d normal_1 / d angle 1 = turn * along_1; correlation = -cos(difference).
  FitVector row(p.size());
  for (const FitPixel& pixel : pixels) {
    const Eigen::Vector2d from = pixel.place - p.head<2>();
    const double u = edges.normal_0.dot(from) * inverse;
    const double v = edges.normal_1.dot(from) * inverse;
    const Crossing crossing = cross(u, v, edges.correlation);
    const int k = kFirstSaddleColour + 2 * pixel.colour;
    const double light = 1.0 + p.segment<2>(5).dot(from);
    const double level = p[k] + p[k + 1] * crossing.value;
    const double scale = light * p[k + 1];
    row.setZero();
    row.head<2>() =
        -scale * inverse * (crossing.by_u * edges.normal_0 + crossing.by_v * edges.normal_1) - level * p.segment<2>(5);
    row[2] = scale * (-crossing.by_u * edges.turn * edges.along_0.dot(from) * inverse -
                      crossing.by_correlation * correlation_by_angle);
    row[3] = scale * (crossing.by_v * edges.turn * edges.along_1.dot(from) * inverse +
                      crossing.by_correlation * correlation_by_angle);
    row[4] = -scale * (crossing.by_u * u + crossing.by_v * v);
    row.segment<2>(5) = level * from;
    row[k] = light;
    row[k + 1] = light * crossing.value;
    sums.add(light * level - pixel.value, row);
  }
  return sums;
}

/// Offset and gain per colour by linear least squares, the rest as in `p`.
void start_levels(FitVector& p, std::span<const FitPixel> pixels, int colours) {
  const Edges edges(p);
  for (int colour = 0; colour < colours; ++colour) {
    Eigen::Matrix2d normal = 1e-6 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    for (const FitPixel& pixel : pixels) {
      if (pixel.colour != colour) continue;
      const Eigen::Vector2d from = pixel.place - p.head<2>();
      const Eigen::Vector2d row(
          1.0,
          cross(edges.normal_0.dot(from) / edges.blur, edges.normal_1.dot(from) / edges.blur, edges.correlation).value);
      normal += row * row.transpose();
      slope += row * pixel.value;
    }
    p.segment<2>(kFirstSaddleColour + 2 * colour) = normal.ldlt().solve(slope);
  }
}

}  // namespace

std::optional<Saddle> fit_saddle(std::span<const FitPixel> pixels, int colours, const Saddle& start) {
  const int unknowns = kFirstSaddleColour + 2 * colours;
  if (static_cast<int>(pixels.size()) < 2 * unknowns) return std::nullopt;
  FitVector p = FitVector::Zero(unknowns);
  p.head<2>() = start.place;
  for (int i = 0; i < 2; ++i) p[2 + i] = std::atan2(start.directions[i].y(), start.directions[i].x());
  p[4] = std::log(start.blur_px);
  start_levels(p, pixels, colours);
  if (!minimise(p, [&](const FitVector& at) { return sums_at(at, pixels); })) return std::nullopt;
  const FitSums sums = sums_at(p, pixels);
  Saddle saddle;
  saddle.place = p.head<2>();
  for (int i = 0; i < 2; ++i) saddle.directions[i] = {std::cos(p[2 + i]), std::sin(p[2 + i])};
  saddle.blur_px = std::exp(p[4]);
  for (const FitPixel& pixel : pixels) saddle.contrast += p[kFirstSaddleColour + 2 * pixel.colour + 1];
  saddle.contrast /= static_cast<double>(pixels.size());
  saddle.noise = std::sqrt(sums.cost / static_cast<double>(static_cast<int>(pixels.size()) - unknowns));
  if (!std::isfinite(saddle.noise)) return std::nullopt;
  return saddle;
}

}  // namespace scanrig
