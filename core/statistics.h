#pragma once

#include <vector>

namespace scanrig {

/// The value below which `fraction` (0..1) of `values` lie, nearest rank; NaN if there are none.
double quantile(std::vector<double> values, double fraction);

/// NaN if there are none.
double root_mean_square(const std::vector<double>& values);

}  // namespace scanrig
