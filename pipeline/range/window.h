#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pipeline/range/lanes.h"
#include "pipeline/range/normal_solver.h"
#include "pipeline/range/window_match.h"

namespace scanrig {

/// The window of radius R around one pixel and everything of the normal equations that does not change while iterating.
/// x and y of the normal equations are in units of the radius. Used by window_match.cpp only, which compiles it once
/// per set of instructions.
template <int R>
class Window {
 public:
  static constexpr int kSide = 2 * R + 1;
  static constexpr int kRowStep = rows_apart(R);  // of the rows that are used; the middle one is
  static constexpr int kFirstRow = R % kRowStep;
  static constexpr int kBlocks = (kSide + kLanes - 1) / kLanes;  // of lanes in a row

  SCANRIG_LANES Window(const MatchImage& here, const MatchMask& mask, int u, int v, const DisparityPatch& patch,
                       const WindowOptions& options);

  /// Lanes beyond the window are read, though not used.
  SCANRIG_LANES static bool fits(const MatchImage& here, int u, int v) {
    return u >= R && v >= R && u - R + kBlocks * kLanes <= here.value.cols && v + R < here.value.rows;
  }
  SCANRIG_LANES bool usable(const WindowOptions& options) const {
    return kRowStep * count_ >= static_cast<double>(options.min_support) * kSide * kSide && variance_ > 1e-3;
  }
  SCANRIG_LANES DisparityPatch match(const MatchImage& there, DisparityPatch patch, const WindowOptions& options);
  SCANRIG_LANES WindowResidual residual(const MatchImage& there, const DisparityPatch& patch) const;

 private:
  static constexpr int kShapes = 6;
  // Exponents of x and y of the six shape functions.
  static constexpr std::array<int, kShapes> kPowerX = {0, 1, 0, 2, 1, 0};
  static constexpr std::array<int, kShapes> kPowerY = {0, 0, 1, 0, 1, 2};
  static constexpr int kMiddle = 3;  // px around the centre

  /// Sums over pixels, of samples s of the other image and values l of this one.
  struct Sums {
    double n = 0.0, s = 0.0, ss = 0.0, sl = 0.0, l = 0.0, ll = 0.0;
  };

  /// here ~ gain * there + offset.
  struct Fit {
    std::array<double, kShapes> rhs{};  // J^T r
    double residual_variance = 0.0, zncc = 0.0, gain = 0.0, offset = 0.0;
    double middle_variance = 0.0;  // of the residual within kMiddle
  };

  /// x of a block's lanes, px from the centre.
  SCANRIG_LANES static void x_of(int block, Lanes& x) {
    for (int k = 0; k < kLanes; ++k) x[k] = static_cast<float>(block * kLanes + k - R);
  }
  SCANRIG_LANES void assemble();
  SCANRIG_LANES void sample(Lanes& into, const MatchImage& there, const DisparityPatch& patch, int row,
                            int block) const;
  SCANRIG_LANES Fit compare(const MatchImage& there, const DisparityPatch& patch, bool is_last) const;
  SCANRIG_LANES double correlation_by_chance() const {
    const double slopes = slopes_ / (variance_ * count_);  // 1 / l^2
    return 1.0 / std::sqrt(std::max(1.0, kRowStep * count_ * std::min(1.0 / kRowStep, slopes / std::numbers::pi)));
  }

  int u_, v_;
  Lanes value_[kSide][kBlocks];   // here, less its mean; 0 where unused
  Lanes slope_[kSide][kBlocks];   // d value / du; 0 where unused
  Lanes weight_[kSide][kBlocks];  // 1 used, 0 not
  float mean_ = 0.0F;
  double count_ = 0.0, variance_ = 0.0, slopes_ = 0.0;
  NormalSolver<kShapes> normal_;
  std::array<double, kShapes> with_one_{}, with_value_{};  // sums of g phi and of g phi value
};

template <int R>
Window<R>::Window(const MatchImage& here, const MatchMask& mask, int u, int v, const DisparityPatch& patch,
                  const WindowOptions& options)
    : u_(u), v_(v) {
  double sum = 0.0;
  for (int block = 0; block < kBlocks; ++block) {
    const int column = u - R + block * kLanes;
    Lanes x;
    x_of(block, x);
    const LaneInts is_inside = x <= static_cast<float>(R);
    for (int row = kFirstRow; row < kSide; row += kRowStep) {
      const int line = v + row - R;
      const float y = static_cast<float>(row - R);
      Lanes value, slope, coarse;
      LaneBytes used;
      load(value, here.value[line] + column);
      load(slope, here.slope[line] + column);
      load(coarse, mask.disparity[line] + column);
      load(used, mask.usable[line] + column);
      const Lanes expected =
          (patch.c[0] + y * (patch.c[2] + patch.c[5] * y)) + x * ((patch.c[1] + patch.c[4] * y) + patch.c[3] * x);
      const Lanes off = coarse - expected;
      // Both false for NaN.
      const LaneInts is_near = (off < options.step_px) & (off > -options.step_px);
      const LaneInts is_far = (off >= options.step_px) | (off <= -options.step_px);
      const LaneInts is_used =
          is_inside & (__builtin_convertvector(used, LaneInts) != 0) & (options.unknown_joins ? ~is_far : is_near);
      const Lanes none = {};
      weight_[row][block] = is_used ? none + 1.0F : none;
      value_[row][block] = is_used ? value : none;
      slope_[row][block] = is_used ? slope : none;
    }
    Lanes values = {}, weights = {};
    for (int row = kFirstRow; row < kSide; row += kRowStep) {
      values += value_[row][block];
      weights += weight_[row][block];
    }
    sum += sum_of(values);
    count_ += sum_of(weights);
  }
  if (count_ < 1.0) return;
  mean_ = static_cast<float>(sum / count_);
  assemble();
}

template <int R>
void Window<R>::assemble() {
  // Moments: sums of f x^i y^j with i + j <= 4 for f = g^2, <= 2 for f = g and g l.
  LaneDoubles gg[5][5] = {}, g[3][3] = {}, gl[3][3] = {};
  double squares = 0.0;
  for (int block = 0; block < kBlocks; ++block) {
    Lanes ggs[5] = {}, gs[3] = {}, gls[3] = {}, square = {};
    for (int row = kFirstRow; row < kSide; row += kRowStep) {
      const float y = static_cast<float>(row - R) / R;
      Lanes& value = value_[row][block];
      value -= mean_ * weight_[row][block];
      const Lanes slope = slope_[row][block];
      Lanes both = slope * slope, with_value = slope * value, alone = slope;
      square += value * value;
      for (int j = 0; j < 5; ++j) {
        ggs[j] += both;
        both *= y;
        if (j > 2) continue;
        gs[j] += alone;
        gls[j] += with_value;
        alone *= y;
        with_value *= y;
      }
    }
    squares += sum_of(square);
    Lanes x_px;
    x_of(block, x_px);
    const LaneDoubles x = __builtin_convertvector(x_px, LaneDoubles) / static_cast<double>(R);
    for (int j = 0; j < 5; ++j) {
      LaneDoubles term = __builtin_convertvector(ggs[j], LaneDoubles);
      for (int i = 0; i + j < 5; ++i, term *= x) gg[i][j] += term;
      if (j > 2) continue;
      LaneDoubles one = __builtin_convertvector(gs[j], LaneDoubles);
      LaneDoubles value = __builtin_convertvector(gls[j], LaneDoubles);
      for (int i = 0; i + j < 3; ++i, one *= x, value *= x) {
        g[i][j] += one;
        gl[i][j] += value;
      }
    }
  }
  variance_ = squares / count_;
  slopes_ = sum_of(gg[0][0]);
  double moments[5][5];
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i + j < 5; ++i) moments[i][j] = sum_of(gg[i][j]);
  }
  for (int i = 0; i < kShapes; ++i) {
    with_one_[i] = sum_of(g[kPowerX[i]][kPowerY[i]]);
    with_value_[i] = sum_of(gl[kPowerX[i]][kPowerY[i]]);
    // Gain and offset eliminated (Schur complement); the values have no mean, so the two are independent.
    for (int j = 0; j <= i; ++j) {
      normal_.at(i, j) = moments[kPowerX[i] + kPowerX[j]][kPowerY[i] + kPowerY[j]] -
                         with_one_[i] * with_one_[j] / count_ - with_value_[i] * with_value_[j] / (variance_ * count_);
    }
  }
}

/// The other image under a block of one row of the window, mapped by the patch.
template <int R>
void Window<R>::sample(Lanes& into, const MatchImage& there, const DisparityPatch& patch, int row, int block) const {
  const float y = static_cast<float>(row - R);
  const float d0 = patch.c[0] + y * (patch.c[2] + y * patch.c[5]);
  const float d1 = patch.c[1] + y * patch.c[4];
  const float last = static_cast<float>(there.value.cols) - 1.001F;
  Lanes x;
  x_of(block, x);
  const Lanes at = (static_cast<float>(u_) + x) - (d0 + x * (d1 + x * patch.c[3]));
  const Lanes none = {};
  Lanes inside = at > 0.0F ? at : none;
  inside = inside < last ? inside : none + last;
  const LaneInts column = __builtin_convertvector(inside, LaneInts);
  cubics_at(into, there.cubic.row(v_ + row - R), column, inside - __builtin_convertvector(column, Lanes));
}

template <int R>
typename Window<R>::Fit Window<R>::compare(const MatchImage& there, const DisparityPatch& patch, bool is_last) const {
  LaneDoubles gs[3][3] = {};
  Sums all, middle;
  for (int block = 0; block < kBlocks; ++block) {
    Lanes moments[3] = {}, s = {}, ss = {}, sl = {};
    Lanes ms = {}, mss = {}, msl = {}, ml = {}, mll = {}, mn = {};  // of the middle rows
    for (int row = kFirstRow; row < kSide; row += kRowStep) {
      Lanes there_value;
      sample(there_value, there, patch, row, block);
      const float y = static_cast<float>(row - R) / R;
      const Lanes value = value_[row][block], weight = weight_[row][block];
      const Lanes one = (there_value - mean_) * weight, slope = slope_[row][block] * one;
      moments[0] += slope;
      moments[1] += slope * y;
      moments[2] += slope * (y * y);
      s += one;
      ss += one * one;
      sl += one * value;
      if (!is_last || row < R - kMiddle || row > R + kMiddle) continue;
      ms += one;
      mss += one * one;
      msl += one * value;
      ml += value;
      mll += value * value;
      mn += weight;
    }
    all.s += sum_of(s);
    all.ss += sum_of(ss);
    all.sl += sum_of(sl);
    Lanes x;
    x_of(block, x);
    const LaneDoubles unit_x = __builtin_convertvector(x, LaneDoubles) / static_cast<double>(R);
    for (int j = 0; j < 3; ++j) {
      LaneDoubles term = __builtin_convertvector(moments[j], LaneDoubles);
      for (int i = 0; i + j < 3; ++i, term *= unit_x) gs[i][j] += term;
    }
    if (!is_last) continue;
    const Lanes none = {};
    const LaneInts in_middle = (x >= static_cast<float>(-kMiddle)) & (x <= static_cast<float>(kMiddle));
    middle.n += sum_of(in_middle ? mn : none);
    middle.s += sum_of(in_middle ? ms : none);
    middle.ss += sum_of(in_middle ? mss : none);
    middle.sl += sum_of(in_middle ? msl : none);
    middle.l += sum_of(in_middle ? ml : none);
    middle.ll += sum_of(in_middle ? mll : none);
  }
  const double there_variance = all.ss / count_ - all.s * all.s / (count_ * count_), covariance = all.sl / count_;
  Fit fit;
  if (!(there_variance > 1e-6)) return fit;
  const double gain = covariance / there_variance, offset = -gain * all.s / count_;
  fit.gain = gain;
  fit.offset = offset;
  fit.zncc = covariance / std::sqrt(there_variance * variance_);
  fit.residual_variance = variance_ * std::max(0.0, 1.0 - fit.zncc * fit.zncc);
  // r = gain s + offset - l, made orthogonal to gain and offset (whose columns are l and 1).
  const double residual_with_value = (gain * covariance - variance_) * count_;
  for (int i = 0; i < kShapes; ++i) {
    fit.rhs[i] = gain * sum_of(gs[kPowerX[i]][kPowerY[i]]) + offset * with_one_[i] - with_value_[i] -
                 with_value_[i] * residual_with_value / (variance_ * count_);
  }
  if (is_last && middle.n > 0.0) {
    const double squares = gain * gain * middle.ss + offset * offset * middle.n + middle.ll +
                           2.0 * (gain * offset * middle.s - gain * middle.sl - offset * middle.l);
    fit.middle_variance = std::max(0.0, squares / middle.n);
  }
  return fit;
}

template <int R>
DisparityPatch Window<R>::match(const MatchImage& there, DisparityPatch patch, const WindowOptions& options) {
  patch.valid = false;
  Fit fit = compare(there, patch, false);
  const double noise = std::max(fit.residual_variance, 1e-4 * variance_ + 1e-3);
  const double curvature = static_cast<double>(options.curvature_prior) * R * R / 49.0;
  const double prior = noise / (curvature * curvature);  // of the second order only
  for (int i = 3; i < kShapes; ++i) normal_.at(i, i) += prior;
  if (!normal_.factorise()) return patch;
  const double variance_gain = normal_.first_of_inverse();
  constexpr std::array<double, kShapes> kUnit = {1.0, R, R, R * R, R * R, R * R};
  std::array<double, kShapes> shape{}, known{}, step{};  // in units of the radius
  for (int i = 0; i < kShapes; ++i) shape[i] = static_cast<double>(patch.c[i]) * kUnit[i];
  for (int i = 3; i < kShapes; ++i) known[i] = static_cast<double>(options.curvature[i - 3]) * kUnit[i];
  const double start = shape[0];
  bool converged = false;
  for (int iteration = 0; iteration < options.max_iterations && !converged; ++iteration) {
    const double stretch = 1.0 - shape[1] / R;
    double largest = 0.0;
    for (int i = 0; i < kShapes; ++i) step[i] = stretch * fit.rhs[i] - (i < 3 ? 0.0 : prior * (shape[i] - known[i]));
    normal_.solve(step);
    for (int i = 0; i < kShapes; ++i) {
      shape[i] += step[i];
      patch.c[i] = static_cast<float>(shape[i] / kUnit[i]);
      if (!std::isfinite(step[i])) return patch;
      largest = std::max(largest, std::abs(step[i]));
    }
    if (std::abs(step[0]) > 2.0) return patch;
    converged = std::abs(step[0]) < options.precision_px && largest < 10.0 * options.precision_px;
    fit = compare(there, patch, converged || iteration + 1 == options.max_iterations);
  }
  if (std::abs(shape[0] - start) > 3.0 || std::abs(shape[1]) > 0.95 * R) return patch;
  patch.sigma = static_cast<float>(std::sqrt(variance_gain * fit.residual_variance) * std::abs(1.0 - shape[1] / R));
  patch.zncc = static_cast<float>(fit.zncc);
  patch.residual = static_cast<float>(fit.residual_variance);
  patch.gain = static_cast<float>(fit.gain);
  patch.centre = static_cast<float>(fit.middle_variance / std::max(fit.residual_variance, 1e-9));
  patch.valid = converged && fit.zncc > static_cast<double>(options.significance) * correlation_by_chance();
  return patch;
}

template <int R>
WindowResidual Window<R>::residual(const MatchImage& there, const DisparityPatch& patch) const {
  constexpr std::size_t kPixels = std::size_t{kSide} * kSide;
  WindowResidual out{kSide, std::vector<float>(kPixels), std::vector<float>(kPixels),
                     std::vector<std::uint8_t>(kPixels)};
  const Fit fit = compare(there, patch, false);
  const float gain = static_cast<float>(fit.gain), offset = static_cast<float>(fit.offset);
  for (int row = kFirstRow; row < kSide; row += kRowStep) {
    for (int block = 0; block < kBlocks; ++block) {
      Lanes there_value;
      sample(there_value, there, patch, row, block);
      const Lanes weight = weight_[row][block], slope = slope_[row][block];
      const Lanes residual = (gain * (there_value - mean_) + offset - value_[row][block]) * weight;
      for (int k = 0; k < kLanes && block * kLanes + k < kSide; ++k) {
        const auto at = static_cast<std::size_t>(row * kSide + block * kLanes + k);
        out.residual[at] = residual[k];
        out.slope[at] = slope[k];
        out.used[at] = weight[k] > 0.0F ? 1 : 0;
      }
    }
  }
  return out;
}

}  // namespace scanrig
