#include "pipeline/range/node_curvature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace scanrig {
namespace {

constexpr int kStride = 4;

/// Nodes of a surface that bends along the columns, with noise of 0.01 px, and from `step_column` on farther by 5 px.
Nodes bent_nodes(float along, float across, int step_column) {
  Nodes nodes({80, 60}, kStride);
  cv::RNG random(7);
  for (int row = 0; row < nodes.rows; ++row) {
    for (int column = 0; column < nodes.columns; ++column) {
      const auto x = static_cast<float>(column * kStride - 40), y = static_cast<float>(row * kStride - 30);
      DisparityPatch& node = nodes.at(column, row);
      node.c = {along * x * x + across * x * y, 2.0F * along * x + across * y, across * x, 0.0F, 0.0F, 0.0F};
      node.c[0] += static_cast<float>(random.gaussian(0.01)) + (column >= step_column ? 5.0F : 0.0F);
      node.valid = true;
    }
  }
  return nodes;
}

TEST(NodeCurvature, IsThatOfTheSurfaceUpToAStep) {
  const Nodes nodes = bent_nodes(0.006F, 0.004F, 11);
  const auto curvature = node_curvature(nodes, {});
  for (int row = 2; row + 2 < nodes.rows; ++row) {
    for (const int column : {4, 9, 11, 14}) {
      const auto& c = curvature[static_cast<std::size_t>(&nodes.at(column, row) - nodes.patches.data())];
      EXPECT_NEAR(c[0], 0.006F, 0.0012F) << column << " " << row;
      EXPECT_NEAR(c[1], 0.004F, 0.0012F) << column << " " << row;
      EXPECT_NEAR(c[2], 0.0F, 0.0012F) << column << " " << row;
    }
  }
}

TEST(NodeCurvature, IsNoneWhereFewNodesAreMatched) {
  Nodes nodes = bent_nodes(0.006F, 0.0F, 1000);
  for (std::size_t i = 0; i < nodes.patches.size(); ++i) nodes.patches[i].valid = i % 3 == 0;
  for (const auto& c : node_curvature(nodes, {})) EXPECT_EQ(c, (std::array<float, 3>{}));
}

/// Disparity with crests and hollows every 90 px.
constexpr double kDepth = 6.0, kWave = 0.07;
double wave(double u) { return kDepth * std::cos(kWave * u); }

/// Mean error of windows of radius 5 on the crests of a noisy pair.
double error_on_crests(bool is_curvature_known) {
  const cv::Size size(900, 300);
  cv::RNG random(3);
  cv::Mat1f left(size), right(size), map_u(size), map_v(size);
  random.fill(left, cv::RNG::NORMAL, 0.0, 120.0);
  cv::GaussianBlur(left, left, {}, 1.2);
  cv::Mat1f disparity(size);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      disparity(v, u) = static_cast<float>(wave(u));
      double from = u;
      for (int i = 0; i < 60; ++i) from = u + wave(from);
      map_u(v, u) = static_cast<float>(from);
      map_v(v, u) = static_cast<float>(v);
    }
  }
  cv::remap(left, right, map_u, map_v, cv::INTER_LANCZOS4);
  for (cv::Mat1f* image : {&left, &right}) {
    cv::Mat1f noise(size);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 8.0);
    *image += noise;
  }
  const MatchImage here(left), there(right);
  const MatchMask mask{cv::Mat1b(size, std::uint8_t{255}), disparity};
  std::vector<double> errors;
  for (int crest = 1; crest < 10; ++crest) {
    const int u = static_cast<int>(std::lround(2.0 * std::numbers::pi * crest / kWave));
    if (u > size.width - 60) break;
    for (int v = 20; v < size.height - 20; v += 4) {
      DisparityPatch start;
      start.c[0] = static_cast<float>(wave(u));
      start.radius = 5;
      WindowOptions options;
      if (is_curvature_known) options.curvature = {static_cast<float>(-0.5 * kDepth * kWave * kWave), 0.0F, 0.0F};
      const DisparityPatch patch = match_window(here, there, mask, u, v, start, options);
      if (patch.valid) errors.push_back(static_cast<double>(patch.c[0]) - wave(u));
    }
  }
  EXPECT_GT(errors.size(), 300U);
  return std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
}

TEST(NodeCurvature, KeepsNoisyWindowsFromFlatteningCrests) {
  const double flattened = error_on_crests(false), kept = error_on_crests(true);
  EXPECT_LT(flattened, -0.02) << "else this test shows nothing";
  EXPECT_LT(std::abs(kept), 0.4 * std::abs(flattened));
}

}  // namespace
}  // namespace scanrig
