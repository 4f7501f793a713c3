#include "pipeline/calibration/corners/disc_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "pipeline/calibration/corners/small_fit.h"

namespace scanrig {
namespace {

// Unknowns: shift 0 1, log of blur 2, log of size 3, then offset and gain per colour.
constexpr int kFirstDiscColour = 4;

Eigen::Matrix<double, 6, 1> quadratic(const Eigen::Vector2d& p) {
  Eigen::Matrix<double, 6, 1> terms;
  terms << 1.0, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y();
  return terms;
}

/// A pixel's distance from the rim of the disc.
struct RimDistance {
  double pixels = 0.0;               // positive outside
  double pixels_per_radius = 1.0;    // along the normal
  Eigen::Vector2d normal{0.0, 0.0};  // outwards, in the image
};

RimDistance rim_distance(const DiscShape& shape, const Eigen::Vector2d& from_centre, double size) {
  const Eigen::Vector2d on_disc = shape.on_disc(from_centre);
  const double radius = on_disc.norm();
  const Eigen::Vector2d outwards = radius > 1e-9 ? Eigen::Vector2d(on_disc / radius) : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d slope = shape.jacobian(from_centre).transpose() * outwards;
  const double steepness = slope.norm();
  return {(radius - size) / steepness, 1.0 / steepness, slope / steepness};
}

/// 1 inside, -1 outside.
double level_at(const RimDistance& rim, double blur) { return -std::erf(rim.pixels / (blur * std::numbers::sqrt2)); }

/// Offset and gain of every colour by linear least squares; returns the sum of squared residuals. `level_of`: of a
/// pixel.
template <class LevelOf>
double fit_levels(FitVector& p, std::span<const FitPixel> pixels, int colours, const LevelOf& level_of) {
  double cost = 0.0;
  for (int colour = 0; colour < colours; ++colour) {
    Eigen::Matrix2d normal = 1e-6 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    double squares = 0.0;
    for (const FitPixel& pixel : pixels) {
      if (pixel.colour != colour) continue;
      const Eigen::Vector2d row(1.0, level_of(pixel));
      normal += row * row.transpose();
      slope += row * pixel.value;
      squares += pixel.value * pixel.value;
    }
    const Eigen::Vector2d levels = normal.ldlt().solve(slope);
    p.segment<2>(kFirstDiscColour + 2 * colour) = levels;
    cost += squares - levels.dot(slope);
  }
  return cost;
}

/// The disc as predicted, 1 px blurred, shifted by whole pixels: levels on a grid, each computed once.
class ShiftedLevels {
 public:
  ShiftedLevels(std::span<const FitPixel> pixels, int largest_shift, const DiscShape& shape) {
    Eigen::AlignedBox2d box;
    for (const FitPixel& pixel : pixels) box.extend(pixel.place);
    const auto room = Eigen::Vector2d::Constant(largest_shift);
    first_ = box.min() - room;
    const Eigen::Vector2d size = box.max() + room - first_;
    columns_ = static_cast<int>(std::lround(size.x())) + 1;
    const int rows = static_cast<int>(std::lround(size.y())) + 1;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns_; ++column) {
        levels_.push_back(level_at(rim_distance(shape, first_ + Eigen::Vector2d(column, row), 1.0), 1.0));
      }
    }
  }
  /// Where the disc is shifted by (x, y), at most `largest_shift`.
  [[nodiscard]] double at(const FitPixel& pixel, int x, int y) const {
    const int column = static_cast<int>(std::lround(pixel.place.x() - first_.x())) - x;
    const int row = static_cast<int>(std::lround(pixel.place.y() - first_.y())) - y;
    return levels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(column)];
  }

 private:
  Eigen::Vector2d first_{0.0, 0.0};
  int columns_ = 0;
  std::vector<double> levels_;
};

/// The whole shift within `search_px` that explains the pixels best, with blur and size as predicted.
FitVector best_start(std::span<const FitPixel> pixels, int colours, const DiscShape& shape, double search_px) {
  const int steps = static_cast<int>(std::ceil(search_px));
  const ShiftedLevels levels(pixels, steps, shape);
  FitVector best = FitVector::Zero(kFirstDiscColour + 2 * colours);
  double best_cost = fit_levels(best, pixels, colours, [&](const FitPixel& pixel) { return levels.at(pixel, 0, 0); });
  for (int y = -steps; y <= steps; ++y) {
    for (int x = -steps; x <= steps; ++x) {
      FitVector p = FitVector::Zero(best.size());
      p.head<2>() << x, y;
      const double cost = fit_levels(p, pixels, colours, [&](const FitPixel& pixel) { return levels.at(pixel, x, y); });
      if (cost < best_cost) {
        best_cost = cost;
        best = p;
      }
    }
  }
  return best;
}

using ColourWeights = std::array<double, 3>;

/// Mean squared residual per colour.
ColourWeights residuals_of(const FitVector& p, std::span<const FitPixel> pixels, const DiscShape& shape) {
  ColourWeights squares{};
  std::array<int, 3> counts{};
  for (const FitPixel& pixel : pixels) {
    const auto colour = static_cast<std::size_t>(pixel.colour);
    const int k = kFirstDiscColour + 2 * pixel.colour;
    const double level = level_at(rim_distance(shape, pixel.place - p.head<2>(), std::exp(p[3])), std::exp(p[2]));
    squares[colour] += std::pow(p[k] + p[k + 1] * level - pixel.value, 2);
    ++counts[colour];
  }
  for (std::size_t i = 0; i < 3; ++i) squares[i] /= std::max(counts[i], 1);
  return squares;
}

/// `weights`: of a residual of each colour, one over its sigma.
FitSums sums_at(const FitVector& p, std::span<const FitPixel> pixels, const DiscShape& shape,
                const ColourWeights& weights) {
  FitSums sums(p.size());
  const double blur = std::exp(p[2]);
  const double size = std::exp(p[3]);
  FitVector row(p.size());
  for (const FitPixel& pixel : pixels) {
    const RimDistance rim = rim_distance(shape, pixel.place - p.head<2>(), size);
    const int k = kFirstDiscColour + 2 * pixel.colour;
    const double level = level_at(rim, blur);
    const double in_sigmas = rim.pixels / blur;
    const double by_sigmas = -p[k + 1] * std::sqrt(2.0 / std::numbers::pi) * std::exp(-0.5 * in_sigmas * in_sigmas);
    row.setZero();
    row.head<2>() = -by_sigmas / blur * rim.normal;
    row[2] = -by_sigmas * in_sigmas;
    row[3] = -by_sigmas / blur * size * rim.pixels_per_radius;
    row[k] = 1.0;
    row[k + 1] = level;
    const double weight = weights[static_cast<std::size_t>(pixel.colour)];
    row *= weight;
    sums.add(weight * (p[k] + p[k + 1] * level - pixel.value), row);
  }
  // Blur and size are known to a fifth and a twentieth before; a faint dot cannot tell them from its contrast.
  FitVector prior = FitVector::Zero(p.size());
  prior[2] = 1.0 / 0.2;
  sums.add(prior[2] * p[2], prior);
  prior.setZero();
  prior[3] = 1.0 / 0.05;
  sums.add(prior[3] * p[3], prior);
  return sums;
}

}  // namespace

std::optional<DiscShape> DiscShape::predict(const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& pixel_of) {
  DiscShape shape;
  shape.centre_ = pixel_of(Eigen::Vector2d::Zero());
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 2> slope = Eigen::Matrix<double, 6, 2>::Zero();
  const auto add = [&](const Eigen::Vector2d& on_disc) {
    const auto terms = quadratic(pixel_of(on_disc) - shape.centre_);
    normal += terms * terms.transpose();
    slope += terms * on_disc.transpose();
  };
  add(Eigen::Vector2d::Zero());
  for (const double radius : {0.5, 1.0, 1.5}) {
    for (int i = 0; i < 12; ++i) {
      const double angle = i * std::numbers::pi / 6.0;
      add(radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  if (!normal.allFinite()) return std::nullopt;
  shape.terms_ = normal.ldlt().solve(slope);
  if (!shape.terms_.allFinite() || !(std::abs(shape.jacobian({0.0, 0.0}).determinant()) > 1e-9)) return std::nullopt;
  return shape;
}

Eigen::Vector2d DiscShape::on_disc(const Eigen::Vector2d& from_centre) const {
  return terms_.transpose() * quadratic(from_centre);
}

Eigen::Matrix2d DiscShape::jacobian(const Eigen::Vector2d& from_centre) const {
  Eigen::Matrix<double, 6, 2> slopes;
  slopes << 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0 * from_centre.x(), 0.0, from_centre.y(), from_centre.x(), 0.0,
      2.0 * from_centre.y();
  return terms_.transpose() * slopes;
}

double explained_by_disc(std::span<const FitPixel> pixels, int colours, const DiscShape& shape) {
  FitVector p = FitVector::Zero(kFirstDiscColour + 2 * colours);
  double explained = -fit_levels(
      p, pixels, colours, [&](const FitPixel& pixel) { return level_at(rim_distance(shape, pixel.place, 1.0), 1.0); });
  for (int colour = 0; colour < colours; ++colour) {
    double count = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    for (const FitPixel& pixel : pixels) {
      if (pixel.colour != colour) continue;
      count += 1.0;
      sum += pixel.value;
      squares += pixel.value * pixel.value;
    }
    if (count > 0.0) explained += squares - sum * sum / count;
  }
  return explained;
}

std::optional<Disc> fit_disc(std::span<const FitPixel> pixels, int colours, const DiscShape& shape, double search_px) {
  const int unknowns = kFirstDiscColour + 2 * colours;
  if (static_cast<int>(pixels.size()) < 3 * unknowns) return std::nullopt;
  FitVector best = best_start(pixels, colours, shape, search_px);
  // Colours differ in noise, the brighter ones have more: each counts by what the fit before leaves of it.
  ColourWeights weights{};
  for (int round = 0; round < 2; ++round) {
    weights = residuals_of(best, pixels, shape);
    for (double& weight : weights) weight = 1.0 / std::sqrt(std::max(weight, 0.05));
    if (!minimise(best, [&](const FitVector& p) { return sums_at(p, pixels, shape, weights); })) return std::nullopt;
  }
  Disc disc;
  disc.shift = best.head<2>();
  disc.blur_px = std::exp(best[2]);
  disc.size = std::exp(best[3]);
  double light = 0.0;
  double squares = 0.0;
  for (const FitPixel& pixel : pixels) {
    const int k = kFirstDiscColour + 2 * pixel.colour;
    const double level = level_at(rim_distance(shape, pixel.place - disc.shift, disc.size), disc.blur_px);
    light += best[k];
    disc.contrast += best[k + 1];
    squares += std::pow(best[k] + best[k + 1] * level - pixel.value, 2);
  }
  disc.contrast /= light;
  disc.noise = std::sqrt(squares / static_cast<double>(pixels.size())) / (light / static_cast<double>(pixels.size()));
  if (!std::isfinite(disc.contrast) || !(disc.shift.norm() <= search_px)) return std::nullopt;
  return disc;
}

}  // namespace scanrig
