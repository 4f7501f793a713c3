#pragma once

namespace scanrig {

/// Geman and McClure's weight of a residual: 1 at 0, 1/4 at `scale`.
inline double robust_weight(double residual, double scale) {
  const double t = 1.0 + (residual / scale) * (residual / scale);
  return 1.0 / (t * t);
}

}  // namespace scanrig
