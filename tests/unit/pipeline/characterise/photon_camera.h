#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>
#include <string>
#include <vector>

#include "pipeline/characterise/characterise.h"

namespace scanrig::photon_camera {

/// A sensor that counts photons, as EMVA 1288 describes it, before an uneven sheet of paper.
struct Camera {
  int width = 640, height = 512;
  int bits = 8;
  double gain = 0.08;        ///< grey values per electron
  double black = 6.0;        ///< grey values
  double read_e = 10.0;      ///< electrons
  double prnu = 0.012;       ///< share
  double column = 0.5;       ///< grey values
  double gamma = 1.0;        ///< with which values are coded
  double paper_slope = 0.3;  ///< loss of light across the image
  double fall_off = 0.0;     ///< loss of light in the corners, as a lens has it
  double flicker = 0.0;      ///< sigma from image to image
  bool is_smoothed = false;  ///< noise reduction
  std::vector<cv::Point> hot;
  double hot_excess = 25.0;
  double electrons_per_us = 1.0;  ///< where the paper is brightest
  std::uint32_t seed = 1;
};

/// Electrons of a pixel. Of many the count is as good as normal, and much sooner drawn.
inline double photons(double expected, std::mt19937& random, std::normal_distribution<double>& normal) {
  if (expected <= 0.0) return 0.0;
  if (expected > 300.0) return std::round(expected + std::sqrt(expected) * normal(random));
  return std::poisson_distribution<int>(expected)(random);
}

inline cv::Mat image(const Camera& camera, double exposure_us, std::uint32_t number) {
  const double full = std::pow(2.0, camera.bits) - 1.0;
  std::mt19937 of_pixels(77 + camera.seed), random(camera.seed * 1000 + number);
  std::normal_distribution<double> fixed(0.0, 1.0), normal(0.0, 1.0);  // each keeps a value for later
  std::vector<double> columns(static_cast<std::size_t>(camera.width));
  for (double& column : columns) column = camera.column * fixed(of_pixels);
  cv::Mat1d grey(camera.height, camera.width);
  const double light = 1.0 + camera.flicker * normal(random);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double own = 1.0 + camera.prnu * fixed(of_pixels);
      const double u = 2.0 * x / camera.width - 1.0, v = 2.0 * y / camera.height - 1.0;
      const double lens = 1.0 - 0.5 * camera.fall_off * (u * u + v * v);
      const double even = lens * (1.0 - camera.paper_slope * x / camera.width), colour = (x + y) % 2 == 0 ? 0.8 : 1.0;
      const double expected = camera.electrons_per_us * exposure_us * light * even * colour * own;
      const double electrons = photons(expected, random, normal) + camera.read_e * normal(random);
      grey(y, x) = camera.black + camera.gain * electrons + columns[static_cast<std::size_t>(x)];
    }
  }
  for (const cv::Point& hot : camera.hot) grey(hot) += camera.hot_excess;
  if (camera.is_smoothed) {
    cv::Mat1d smooth = grey.clone();
    const double middle = cv::mean(grey)[0];
    smooth = middle + (grey - middle) * (4.0 / std::max(4.0, std::sqrt(middle) * middle));
    grey = smooth;
  }
  cv::Mat coded(camera.height, camera.width, camera.bits > 8 ? CV_16U : CV_8U);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double value = full * std::pow(std::clamp(grey(y, x) / full, 0.0, 1.0), camera.gamma);
      if (camera.bits > 8) {
        coded.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(std::lround(value));
      } else {
        coded.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::lround(value));
      }
    }
  }
  return coded;
}

inline FlatPair pair(const Camera& camera, double exposure_us, std::uint32_t number) {
  const std::string name = exposure_us > 0.0 ? fmt::format("left_{:.0f}us", exposure_us) : std::string("left_dark");
  return {name, exposure_us, image(camera, exposure_us, 2 * number), image(camera, exposure_us, 2 * number + 1)};
}

inline const std::vector<double> kExposures{100.0, 250.0, 500.0, 1000.0, 1700.0, 2500.0};

inline std::vector<FlatPair> series(const Camera& camera, const std::vector<double>& exposures = kExposures,
                                    int dark_pairs = 3) {
  std::vector<FlatPair> pairs;
  std::uint32_t number = 1;
  for (int k = 0; k < dark_pairs; ++k) pairs.push_back(pair(camera, 0.0, number++));
  for (const double exposure : exposures) pairs.push_back(pair(camera, exposure, number++));
  return pairs;
}

}  // namespace scanrig::photon_camera
