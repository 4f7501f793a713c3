#pragma once

#include <vector>

namespace scanrig {

/// The value below which `fraction` (0..1) of `values` lie, nearest rank; NaN for no values.
double quantile(std::vector<double> values, double fraction);

/// Root mean square; NaN for no values.
double root_mean_square(const std::vector<double>& values);

}  // namespace scanrig
