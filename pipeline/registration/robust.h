#pragma once

#include <vector>

namespace scanrig {

/// The value below which `fraction` of `values` lie; NaN if there are none.
double quantile(std::vector<double> values, double fraction);

/// Root mean square; NaN if there are none.
double root_mean_square(const std::vector<double>& values);

/// Geman and McClure's weight of a residual: 1 at 0, 1/4 at `scale`.
inline double robust_weight(double residual, double scale) {
  const double t = 1.0 + (residual / scale) * (residual / scale);
  return 1.0 / (t * t);
}

}  // namespace scanrig
