#include "pipeline/range/window_match.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Exponents of x and y of the six shape functions.
constexpr std::array<int, 6> kPowerX = {0, 1, 0, 2, 1, 0};
constexpr std::array<int, 6> kPowerY = {0, 0, 1, 0, 1, 2};
constexpr int kCentre = 3;

/// Sums over a window, times powers of y, one per column ("lane"): adding row by row vectorises in any instruction set
/// and always in the same order. x and y are in units of the radius.
template <int kLanes, int kPowers>
struct Moments {
  alignas(64) float sums[kPowers][kLanes] = {};

  /// Sum over the window of f x^i y^j.
  [[nodiscard]] double at(const float* x, int i, int j) const {
    double sum = 0.0;
    for (int k = 0; k < kLanes; ++k) {
      const double xk = static_cast<double>(x[k]);
      double term = static_cast<double>(sums[j][k]);
      for (int n = 0; n < i; ++n) term *= xk;
      sum += term;
    }
    return sum;
  }
};

/// The window of radius R around one pixel and everything of the normal equations that does not change while iterating.
template <int R>
class Window {
 public:
  static constexpr int kSide = 2 * R + 1;
  static constexpr int kLanes = (kSide + 7) / 8 * 8;

  Window(const MatchImage& here, const MatchMask& mask, int u, int v, const DisparityPatch& patch,
         const WindowOptions& options);

  [[nodiscard]] bool usable(const WindowOptions& options) const {
    return count_ >= options.min_support * kSide * kSide && variance_ > 1e-3;
  }
  [[nodiscard]] DisparityPatch match(const MatchImage& there, DisparityPatch patch, const WindowOptions& options);
  [[nodiscard]] WindowResidual residual(const MatchImage& there, const DisparityPatch& patch) const;

 private:
  struct Fit {
    Vector6 rhs;  // J^T r
    double residual_variance = 0.0;
    double zncc = 0.0;
    double gain = 0.0, offset = 0.0;
  };

  void assemble();
  void sample_row(const float* cubic, const DisparityPatch& patch, int row, float* out) const;
  [[nodiscard]] Fit compare(const MatchImage& there, const DisparityPatch& patch) const;
  [[nodiscard]] double centre_variance(const MatchImage& there, const DisparityPatch& patch, const Fit& fit) const;
  [[nodiscard]] double correlation_by_chance() const;

  int u_, v_, width_ = 0;
  alignas(64) float x_[kLanes];
  alignas(64) float value_[kSide][kLanes];   // here, less its mean; 0 where unused
  alignas(64) float slope_[kSide][kLanes];   // d value / du; 0 where unused
  alignas(64) float weight_[kSide][kLanes];  // 1 used, 0 not
  double mean_ = 0.0, count_ = 0.0, variance_ = 0.0;
  Moments<kLanes, 5> gg_;
  Moments<kLanes, 3> g_, gl_;
  Matrix6 normal_;
  Vector6 with_one_, with_value_;  // sums of g phi and of g phi value
};

template <int R>
Window<R>::Window(const MatchImage& here, const MatchMask& mask, int u, int v, const DisparityPatch& patch,
                  const WindowOptions& options)
    : u_(u), v_(v), width_(here.value.cols) {
  for (int k = 0; k < kLanes; ++k) x_[k] = static_cast<float>(k - R) / R;
  double sum = 0.0;
  for (int row = 0; row < kSide; ++row) {
    const int y = v + row - R;
    const float* value = here.value[y] + u - R;
    const float* slope = here.cubic.row(y) + (u - R) * 4 + 1;
    const std::uint8_t* used = mask.usable[y] + u - R;
    const float* coarse = mask.disparity[y] + u - R;
    float row_sum = 0.0f, row_count = 0.0f;
    for (int k = 0; k < kLanes; ++k) {
      const bool inside = k < kSide;
      const float expected = patch.at(static_cast<float>(k - R), static_cast<float>(row - R));
      // Both false for NaN.
      const float off = std::abs(coarse[k] - expected);
      const bool near = off < options.step_px, far = off >= options.step_px;
      const bool same = inside && used[k] != 0 && (near || (options.unknown_joins && !far));
      const float w = same ? 1.0f : 0.0f;
      weight_[row][k] = w;
      value_[row][k] = same ? value[k] : 0.0f;
      slope_[row][k] = same ? slope[4 * k] : 0.0f;
      row_sum += value_[row][k];
      row_count += w;
    }
    sum += static_cast<double>(row_sum);
    count_ += static_cast<double>(row_count);
  }
  if (count_ < 1.0) return;
  mean_ = sum / count_;
  assemble();
}

template <int R>
void Window<R>::assemble() {
  const float mean = static_cast<float>(mean_);
  double squares = 0.0;
  for (int row = 0; row < kSide; ++row) {
    const float y = static_cast<float>(row - R) / R;
    const float y2 = y * y, y3 = y2 * y, y4 = y2 * y2;
    float* value = value_[row];
    const float* slope = slope_[row];
    alignas(64) float square[kLanes];
    for (int k = 0; k < kLanes; ++k) {
      value[k] -= mean * weight_[row][k];
      const float g = slope[k], l = value[k], gg = g * g, gl = g * l;
      gg_.sums[0][k] += gg;
      gg_.sums[1][k] += gg * y;
      gg_.sums[2][k] += gg * y2;
      gg_.sums[3][k] += gg * y3;
      gg_.sums[4][k] += gg * y4;
      g_.sums[0][k] += g;
      g_.sums[1][k] += g * y;
      g_.sums[2][k] += g * y2;
      gl_.sums[0][k] += gl;
      gl_.sums[1][k] += gl * y;
      gl_.sums[2][k] += gl * y2;
      square[k] = l * l;
    }
    for (int k = 0; k < kLanes; ++k) squares += static_cast<double>(square[k]);
  }
  variance_ = squares / count_;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      normal_(i, j) = normal_(j, i) = gg_.at(x_, kPowerX[i] + kPowerX[j], kPowerY[i] + kPowerY[j]);
    }
    with_one_[i] = g_.at(x_, kPowerX[i], kPowerY[i]);
    with_value_[i] = gl_.at(x_, kPowerX[i], kPowerY[i]);
  }
}

/// The other image under one row of the window, mapped by the patch.
template <int R>
void Window<R>::sample_row(const float* cubic, const DisparityPatch& patch, int row, float* out) const {
  const float y = static_cast<float>(row - R);
  const float d0 = patch.c[0] + y * (patch.c[2] + y * patch.c[5]);
  const float d1 = patch.c[1] + y * patch.c[4];
  const float last = static_cast<float>(width_) - 1.001f;
  alignas(64) float t[kLanes];
  alignas(64) int column[kLanes];
  for (int k = 0; k < kLanes; ++k) {
    const float x = static_cast<float>(k - R);
    const float at = static_cast<float>(u_) + x - (d0 + x * (d1 + x * patch.c[3]));
    const float inside = std::min(std::max(at, 0.0f), last);
    column[k] = static_cast<int>(inside);
    t[k] = inside - static_cast<float>(column[k]);
  }
  for (int k = 0; k < kLanes; ++k) {
    const float* c = cubic + 4 * column[k];
    out[k] = c[0] + t[k] * (c[1] + t[k] * (c[2] + t[k] * c[3]));
  }
}

template <int R>
typename Window<R>::Fit Window<R>::compare(const MatchImage& there, const DisparityPatch& patch) const {
  Moments<kLanes, 3> gs;
  alignas(64) float sums[3][kLanes] = {};  // s, s^2, s l
  const float mean = static_cast<float>(mean_);
  for (int row = 0; row < kSide; ++row) {
    alignas(64) float sample[kLanes];
    sample_row(there.cubic.row(v_ + row - R), patch, row, sample);
    const float y = static_cast<float>(row - R) / R, y2 = y * y;
    const float *value = value_[row], *slope = slope_[row], *weight = weight_[row];
    for (int k = 0; k < kLanes; ++k) {
      const float s = (sample[k] - mean) * weight[k], g = slope[k] * s;
      gs.sums[0][k] += g;
      gs.sums[1][k] += g * y;
      gs.sums[2][k] += g * y2;
      sums[0][k] += s;
      sums[1][k] += s * s;
      sums[2][k] += s * value[k];
    }
  }
  double s = 0.0, ss = 0.0, sl = 0.0;
  for (int k = 0; k < kLanes; ++k) {
    s += static_cast<double>(sums[0][k]);
    ss += static_cast<double>(sums[1][k]);
    sl += static_cast<double>(sums[2][k]);
  }
  // here ~ gain * there + offset, the means being removed.
  const double there_variance = ss / count_ - s * s / (count_ * count_), covariance = sl / count_;
  Fit fit;
  fit.rhs.setZero();
  if (!(there_variance > 1e-6)) return fit;
  const double gain = covariance / there_variance, offset = -gain * s / count_;
  fit.gain = gain;
  fit.offset = offset;
  fit.zncc = covariance / std::sqrt(there_variance * variance_);
  fit.residual_variance = variance_ * std::max(0.0, 1.0 - fit.zncc * fit.zncc);
  // r = gain s + offset - l, made orthogonal to gain and offset (whose columns are l and 1).
  const double residual_with_value = (gain * covariance - variance_) * count_;
  for (int i = 0; i < 6; ++i) {
    fit.rhs[i] = gain * gs.at(x_, kPowerX[i], kPowerY[i]) + offset * with_one_[i] - with_value_[i] -
                 with_value_[i] * residual_with_value / (variance_ * count_);
  }
  return fit;
}

template <int R>
DisparityPatch Window<R>::match(const MatchImage& there, DisparityPatch patch, const WindowOptions& options) {
  patch.valid = false;
  // Gain and offset eliminated (Schur complement); the values have no mean, so the two are independent.
  Matrix6 reduced = normal_ - with_one_ * with_one_.transpose() / count_ -
                    with_value_ * with_value_.transpose() / (variance_ * count_);
  Fit fit = compare(there, patch);
  const double noise = std::max(fit.residual_variance, 1e-4 * variance_ + 1e-3);
  const double curvature = static_cast<double>(options.curvature_prior) * R * R / 49.0;
  Vector6 prior = Vector6::Zero();
  prior.tail<3>().setConstant(noise / (curvature * curvature));
  Matrix6 regular = reduced;
  regular.diagonal() += prior;
  const Eigen::LLT<Matrix6> solver(regular);
  if (solver.info() != Eigen::Success) return patch;

  Vector6 shape;  // in units of the radius
  const Vector6 unit{1.0, R, R, R * R, R * R, R * R};
  for (int i = 0; i < 6; ++i) shape[i] = static_cast<double>(patch.c[static_cast<std::size_t>(i)]) * unit[i];
  const double start = shape[0];
  Vector6 first = Vector6::Zero();
  first[0] = 1.0;
  const double variance_gain = solver.solve(first)[0];
  bool converged = false;
  for (int iteration = 0; iteration < options.max_iterations && !converged; ++iteration) {
    const double stretch = 1.0 - shape[1] / R;
    const Vector6 step = solver.solve(stretch * fit.rhs - prior.cwiseProduct(shape));
    if (!step.allFinite() || std::abs(step[0]) > 2.0) return patch;
    shape += step;
    for (int i = 0; i < 6; ++i) patch.c[static_cast<std::size_t>(i)] = static_cast<float>(shape[i] / unit[i]);
    converged = std::abs(step[0]) < options.precision_px && step.cwiseAbs().maxCoeff() < 10.0 * options.precision_px;
    if (iteration + 1 < options.max_iterations && !converged) fit = compare(there, patch);
  }
  fit = compare(there, patch);
  if (std::abs(shape[0] - start) > 3.0 || std::abs(shape[1]) > 0.95 * R) return patch;
  patch.sigma = static_cast<float>(std::sqrt(variance_gain * fit.residual_variance) * std::abs(1.0 - shape[1] / R));
  patch.zncc = static_cast<float>(fit.zncc);
  patch.residual = static_cast<float>(fit.residual_variance);
  patch.gain = static_cast<float>(fit.gain);
  patch.centre = static_cast<float>(centre_variance(there, patch, fit) / std::max(fit.residual_variance, 1e-9));
  patch.valid = converged && fit.zncc > static_cast<double>(options.significance) * correlation_by_chance();
  return patch;
}

template <int R>
double Window<R>::correlation_by_chance() const {
  const double slopes = gg_.at(x_, 0, 0) / (variance_ * count_);  // 1 / l^2
  return 1.0 / std::sqrt(std::max(1.0, count_ * std::min(1.0, slopes / std::numbers::pi)));
}

/// Of the residual within kCentre pixels of the middle.
template <int R>
double Window<R>::centre_variance(const MatchImage& there, const DisparityPatch& patch, const Fit& fit) const {
  const float mean = static_cast<float>(mean_), gain = static_cast<float>(fit.gain),
              offset = static_cast<float>(fit.offset);
  float squares = 0.0f, count = 0.0f;
  for (int row = R - kCentre; row <= R + kCentre; ++row) {
    alignas(64) float sample[kLanes];
    sample_row(there.cubic.row(v_ + row - R), patch, row, sample);
    for (int k = R - kCentre; k <= R + kCentre; ++k) {
      const float r = (gain * (sample[k] - mean) + offset - value_[row][k]) * weight_[row][k];
      squares += r * r;
      count += weight_[row][k];
    }
  }
  return count > 0.0f ? static_cast<double>(squares / count) : 0.0;
}

template <int R>
WindowResidual Window<R>::residual(const MatchImage& there, const DisparityPatch& patch) const {
  WindowResidual out{kSide, {}, {}, {}};
  const Fit fit = compare(there, patch);
  const float mean = static_cast<float>(mean_), gain = static_cast<float>(fit.gain),
              offset = static_cast<float>(fit.offset);
  for (int row = 0; row < kSide; ++row) {
    alignas(64) float sample[kLanes];
    sample_row(there.cubic.row(v_ + row - R), patch, row, sample);
    for (int k = 0; k < kSide; ++k) {
      out.residual.push_back((gain * (sample[k] - mean) + offset - value_[row][k]) * weight_[row][k]);
      out.slope.push_back(slope_[row][k]);
      out.used.push_back(weight_[row][k] > 0.0f ? 1 : 0);
    }
  }
  return out;
}

template <int R>
DisparityPatch match_with(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                          DisparityPatch patch, const WindowOptions& options) {
  using W = Window<R>;
  patch.valid = false;
  // Lanes beyond the window are read, though not used.
  if (u < R || v < R || u + W::kLanes - R > here.value.cols || v + R >= here.value.rows) return patch;
  Window<R> window(here, mask, u, v, patch, options);
  if (!window.usable(options)) return patch;
  return window.match(there, patch, options);
}

template <int R>
WindowResidual residual_with(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                             const DisparityPatch& patch, const WindowOptions& options) {
  using W = Window<R>;
  if (u < R || v < R || u + W::kLanes - R > here.value.cols || v + R >= here.value.rows) return {};
  const W window(here, mask, u, v, patch, options);
  return window.usable(options) ? window.residual(there, patch) : WindowResidual{};
}

}  // namespace

MatchImage::MatchImage(const cv::Mat1f& image) : value(image), cubic(image) {}

DisparityPatch match_window(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                            const DisparityPatch& patch, const WindowOptions& options) {
  switch (patch.radius) {
    case 5: return match_with<5>(here, there, mask, u, v, patch, options);
    case 7: return match_with<7>(here, there, mask, u, v, patch, options);
    case 10: return match_with<10>(here, there, mask, u, v, patch, options);
    default: return match_with<15>(here, there, mask, u, v, patch, options);
  }
}

WindowResidual window_residual(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                               const DisparityPatch& patch, const WindowOptions& options) {
  switch (patch.radius) {
    case 5: return residual_with<5>(here, there, mask, u, v, patch, options);
    case 7: return residual_with<7>(here, there, mask, u, v, patch, options);
    case 10: return residual_with<10>(here, there, mask, u, v, patch, options);
    default: return residual_with<15>(here, there, mask, u, v, patch, options);
  }
}

}  // namespace scanrig
