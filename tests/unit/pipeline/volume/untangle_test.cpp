#include "pipeline/volume/untangle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/mesh/self_intersection.h"

namespace scanrig {
namespace {

constexpr std::uint32_t kSide = 6;  // vertices of a sheet along each axis

/// Two sheets, 1 mm apart, their vertices not above each other.
Mesh sheets() {
  Mesh mesh;
  for (const float height : {0.0F, 1.0F}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
      const std::uint32_t row = i / kSide, column = i % kSide;
      mesh.vertices.emplace_back(static_cast<float>(column) + 0.3F * height, height,
                                 static_cast<float>(row) + 0.4F * height);
    }
    for (std::uint32_t row = 0; row + 1 < kSide; ++row) {
      for (std::uint32_t column = 0; column + 1 < kSide; ++column) {
        const std::uint32_t at = first + row * kSide + column;
        mesh.faces.push_back({at, at + kSide, at + 1});
        mesh.faces.push_back({at + 1, at + kSide, at + kSide + 1});
      }
    }
  }
  mesh.views.assign(mesh.vertices.size(), 3);
  mesh.sigma.assign(mesh.vertices.size(), 0.01F);
  return mesh;
}

std::size_t crossing(const Mesh& mesh) { return self_intersecting_faces(mesh).size(); }

TEST(Untangle, TakesBackTheCornersOfFacesThatCross) {
  Mesh mesh = sheets();
  const auto before = mesh.vertices;
  constexpr std::uint32_t kPeak = 2 * kSide + 2, kCalm = 4 * kSide + 4;
  mesh.vertices[kPeak].y() = 1.4F;  // through the upper sheet
  mesh.vertices[kCalm].y() = 0.2F;
  ASSERT_GT(crossing(mesh), 0U) << "else this test shows nothing";
  EXPECT_GT(untangle(before, mesh), 0U);
  EXPECT_EQ(crossing(mesh), 0U);
  EXPECT_EQ(mesh.vertices[kPeak], before[kPeak]);
  EXPECT_EQ(mesh.views[kPeak], 0);
  EXPECT_TRUE(std::isnan(mesh.sigma[kPeak]));
  EXPECT_EQ(mesh.vertices[kCalm].y(), 0.2F) << "what crosses nothing stays";
  EXPECT_EQ(mesh.views[kCalm], 3);
}

TEST(Untangle, LeavesASoundMeshAlone) {
  Mesh mesh = sheets();
  const auto before = mesh.vertices;
  mesh.vertices[7].y() = 0.3F;
  EXPECT_EQ(untangle(before, mesh), 0U);
  EXPECT_EQ(mesh.vertices[7].y(), 0.3F);
}

TEST(Untangle, EndsWhereFacesCrossedBefore) {
  Mesh mesh = sheets();
  mesh.vertices[2 * kSide + 2].y() = 1.4F;
  const auto before = mesh.vertices;
  untangle(before, mesh);
  EXPECT_GT(crossing(mesh), 0U);
}

}  // namespace
}  // namespace scanrig
