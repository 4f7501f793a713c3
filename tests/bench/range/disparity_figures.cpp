#include "tests/bench/range/disparity_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanrig::bench {
namespace {

constexpr float kStepPx = 1.5F;  // between neighbouring pixels: a depth step
constexpr std::array<double, 6> kBands = {30.0, 55.0, 60.0, 70.0, 80.0, 90.0};
constexpr double kHonest = 0.6745;  // median of abs(error) / sigma of a normal distribution

/// Distance of each pixel to the nearest pixel beside a step of the truth, px.
cv::Mat1f distance_to_steps(const cv::Mat1f& truth) {
  cv::Mat1b apart(truth.size(), std::uint8_t{255});
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      if (u + 1 < truth.cols && std::abs(truth(v, u) - truth(v, u + 1)) > kStepPx) apart(v, u) = apart(v, u + 1) = 0;
      if (v + 1 < truth.rows && std::abs(truth(v, u) - truth(v + 1, u)) > kStepPx) apart(v, u) = apart(v + 1, u) = 0;
    }
  }
  cv::Mat1f distance;
  cv::distanceTransform(apart, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distance;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

nlohmann::json number(double value) {
  return std::isfinite(value) ? nlohmann::json(std::round(value * 1e5) / 1e5) : nlohmann::json();
}

}  // namespace

void DisparityFigures::Group::add(double error, double sigma) {
  errors.push_back(std::abs(error));
  ratios.push_back(std::abs(error) / sigma);
}

nlohmann::json DisparityFigures::Group::json() const {
  const double measured = static_cast<double>(errors.size());
  const auto beyond = [&](const std::vector<double>& values, double limit) {
    return static_cast<double>(std::count_if(values.begin(), values.end(), [&](double v) { return v > limit; })) /
           measured;
  };
  return {{"pixels", wanted},
          {"coverage", number(measured / wanted)},
          {"median_px", number(quantile(errors, 0.5))},
          {"p95_px", number(quantile(errors, 0.95))},
          {"over_1px", number(beyond(errors, 1.0))},
          {"over_3_sigma", number(beyond(ratios, 3.0))},
          {"error_by_sigma", number(quantile(ratios, 0.5) / kHonest)}};
}

void DisparityFigures::add(const DisparityPair& pair) {
  const cv::Mat1f steps = distance_to_steps(pair.truth);
  double wrong = 0.0, measured_hidden = 0.0;
  for (int v = 0; v < pair.truth.rows; ++v) {
    for (int u = 0; u < pair.truth.cols; ++u) {
      if (std::isnan(pair.truth(v, u))) continue;
      const bool measured = std::isfinite(pair.measured(v, u));
      const double error = static_cast<double>(pair.measured(v, u)) - static_cast<double>(pair.truth(v, u));
      const double sigma = static_cast<double>(pair.sigma(v, u));
      if (pair.seen_by_all(v, u) == 0) {
        measured_hidden += measured ? 1.0 : 0.0;
        wrong += measured && std::abs(error) > 3.0 * sigma ? 1.0 : 0.0;
        continue;
      }
      const double incidence = pair.incidence.empty() ? 0.0 : static_cast<double>(pair.incidence(v, u));
      std::size_t band = 0;
      while (incidence > kBands[band] && band + 1 < kBands.size()) ++band;
      const bool edge = steps(v, u) <= 10.0F;
      std::vector<Group*> groups;
      if (!edge) groups.push_back(&bands_[band]);
      if (incidence <= 70.0) groups.push_back(edge ? &edges_ : &inner_);
      for (Group* group : groups) {
        group->wanted += 1.0;
        if (measured) group->add(error, sigma);
      }
      if (edge && measured && std::abs(error) > 1.0 && steps(v, u) > 2.0F) wide_ += 1.0;
    }
  }
  hidden_wrong_.push_back(wrong);
  hidden_measured_.push_back(measured_hidden);
}

nlohmann::json DisparityFigures::json() const {
  nlohmann::json bands;
  for (std::size_t i = 0; i < bands_.size(); ++i) {
    if (bands_[i].wanted > 0.0) bands[std::to_string(static_cast<int>(kBands[i]))] = bands_[i].json();
  }
  return {{"inner", inner_.json()},
          {"edges", edges_.json()},
          {"bands", bands},
          {"edges_wrong_beyond_2px", wide_},
          {"hidden_wrong", *std::max_element(hidden_wrong_.begin(), hidden_wrong_.end())},
          {"hidden_measured", *std::max_element(hidden_measured_.begin(), hidden_measured_.end())}};
}

}  // namespace scanrig::bench
