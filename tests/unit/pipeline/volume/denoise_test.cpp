#include "pipeline/volume/denoise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

namespace scanrig {
namespace {

constexpr std::uint32_t kSheetSide = 100;  // vertices of the sheet along each axis
constexpr float kEdgeMm = 0.25F, kSigmaMm = 0.01F, kWindowMm = 1.0F;

/// A measured sheet over x and z, its middle at 0.
Mesh sheet(const std::function<float(float x, float z)>& height) {
  Mesh mesh;
  const auto along = [](std::uint32_t index) { return (static_cast<float>(index) - 0.5F * kSheetSide) * kEdgeMm; };
  for (std::uint32_t row = 0; row < kSheetSide; ++row) {
    for (std::uint32_t column = 0; column < kSheetSide; ++column) {
      const float x = along(column), z = along(row);
      mesh.vertices.emplace_back(x, height(x, z), z);
    }
  }
  for (std::uint32_t row = 0; row + 1 < kSheetSide; ++row) {
    for (std::uint32_t column = 0; column + 1 < kSheetSide; ++column) {
      const std::uint32_t at = row * kSheetSide + column;
      mesh.faces.push_back({at, at + kSheetSide, at + 1});
      mesh.faces.push_back({at + 1, at + kSheetSide, at + kSheetSide + 1});
    }
  }
  mesh.views.assign(mesh.vertices.size(), 3);
  mesh.sigma.assign(mesh.vertices.size(), kSigmaMm);
  return mesh;
}

bool is_inner(std::uint32_t v) {
  constexpr std::uint32_t kRim = 20;
  const std::uint32_t row = v / kSheetSide, column = v % kSheetSide;
  return row >= kRim && row < kSheetSide - kRim && column >= kRim && column < kSheetSide - kRim;
}

float bowl(float x, float z) { return 0.02F * (x * x + z * z); }  // of 25 mm radius

/// Noise of kSigmaMm that neighbours share, as windows of matching do.
Mesh noisy_bowl() {
  Mesh mesh = sheet(bowl);
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0.0F, 1.0F);
  std::vector<float> noise(mesh.vertices.size());
  for (float& value : noise) value = normal(random);
  noise = VertexNeighbours(mesh).smoothed(std::move(noise), 2);
  double squares = 0.0;
  for (const float value : noise) squares += static_cast<double>(value * value);
  const auto scale = static_cast<float>(1.0 / std::sqrt(squares / static_cast<double>(noise.size())));
  for (std::size_t v = 0; v < noise.size(); ++v) mesh.vertices[v].y() += kSigmaMm * scale * noise[v];
  return mesh;
}

double rms(const Mesh& mesh, const std::function<float(float x, float z)>& truth) {
  double squares = 0.0;
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!is_inner(v)) continue;
    const auto& p = mesh.vertices[v];
    squares += static_cast<double>((p.y() - truth(p.x(), p.z())) * (p.y() - truth(p.x(), p.z())));
    ++count;
  }
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(Denoise, TakesNoiseOutOfAQuadraticAndItsSigmaWithIt) {
  Mesh mesh = noisy_bowl();
  const double before = rms(mesh, bowl);
  denoise(VertexNeighbours(mesh), {}, kWindowMm, mesh);
  const double after = rms(mesh, bowl);
  EXPECT_LT(after, 0.6 * before);
  double sigma = 0.0;
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (is_inner(v)) sigma += static_cast<double>(mesh.sigma[v]), ++count;
  }
  sigma /= static_cast<double>(count);
  EXPECT_LT(sigma, 0.9 * static_cast<double>(kSigmaMm));
  EXPECT_GT(sigma, after) << "sigma promises no more than there is";
}

/// The highest vertex of a sheet of waves as long as a matching window, denoised.
float crest(float height_mm, float* min_sigma) {
  Mesh mesh = sheet([&](float x, float) { return height_mm * std::sin(std::numbers::pi_v<float> * x / kWindowMm); });
  denoise(VertexNeighbours(mesh), {}, kWindowMm, mesh);
  float highest = 0.0F;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!is_inner(v)) continue;
    highest = std::max(highest, mesh.vertices[v].y());
    *min_sigma = std::min(*min_sigma, mesh.sigma[v]);
  }
  return highest;
}

TEST(Denoise, KeepsShapeOfAWindowsSizeAndWidensSigmaThere) {
  constexpr float kLow = 0.03F, kHigh = 0.3F;
  float sigma = 1.0F;
  const float low = crest(kLow, &sigma);
  EXPECT_NEAR(low, kLow, 0.1F * kLow) << "a Gaussian of half that width leaves a third";
  EXPECT_GT(sigma, 1.2F * kSigmaMm);
  sigma = 1.0F;
  EXPECT_EQ(crest(kHigh, &sigma), kHigh) << "what is far above noise is left as it is";
  EXPECT_GT(sigma, 5.0F * kSigmaMm);
}

TEST(Denoise, LeavesWhatIsNotMeasuredAndWhatBordersOnIt) {
  Mesh mesh = noisy_bowl();
  constexpr std::uint32_t kMiddle = kSheetSide / 2;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (v % kSheetSide < kMiddle) continue;
    mesh.views[v] = 0;
    mesh.sigma[v] = std::numeric_limits<float>::quiet_NaN();
    mesh.vertices[v].y() += 0.01F;  // less than noise, so that it would draw the rest along
  }
  const Mesh before = mesh;
  denoise(VertexNeighbours(mesh), {}, kWindowMm, mesh);
  std::size_t moved = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const std::uint32_t column = v % kSheetSide;
    if (column >= kMiddle) {
      ASSERT_EQ(mesh.vertices[v], before.vertices[v]);
      ASSERT_TRUE(std::isnan(mesh.sigma[v]));
    } else if (column + 3 >= kMiddle) {  // 0.75 mm
      ASSERT_EQ(mesh.vertices[v], before.vertices[v]) << column;
      ASSERT_GE(mesh.sigma[v], kSigmaMm);
    } else if (mesh.vertices[v] != before.vertices[v]) {
      ++moved;
    }
  }
  EXPECT_GT(moved, mesh.vertices.size() / 4);
}

TEST(Denoise, NeedsAMatchingWindow) {
  Mesh mesh = noisy_bowl();
  const Mesh before = mesh;
  denoise(VertexNeighbours(mesh), {}, 0.0F, mesh);
  EXPECT_EQ(mesh.vertices, before.vertices);
  EXPECT_EQ(mesh.sigma, before.sigma);
}

}  // namespace
}  // namespace scanrig
