#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pipeline/acceptance/acceptance.h"
#include "tests/unit/pipeline/acceptance/artefact_mesh.h"

namespace scanrig::acceptance {
namespace {

using artefact_mesh::box;
using Eigen::Vector3d;
using testing::HasSubstr;

/// A plate that leans back, bowed along x: its middle is `bow_mm` in front of its ends, 30 mm away.
Mesh plate(double bow_mm) {
  const Eigen::AngleAxisd upright(0.25, Vector3d::UnitX());
  const auto field = [&](const Vector3d& p) {
    Vector3d q = upright * p;
    q.z() += bow_mm * q.x() * q.x() / (30.0 * 30.0);
    return box(q, {-30.0, 0.0, -6.0}, {30.0, 40.0, 0.0});
  };
  return artefact_mesh::model(field, {-31, -3, -20}, {31, 42, 12});
}

TEST(Planes, AFlatFaceIsFlatAndTheLargestIsTaken) {
  const auto found = measure(plate(0.0), {.kind = Kind::plane});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->results.size(), 1U);
  EXPECT_NEAR(found->results[0].value_mm, 0.0, 1e-4);
  const Feature& face = found->features.at(0);
  EXPECT_GT(face.area_mm2, 0.5 * 60.0 * 40.0);
  EXPECT_LT(face.area_mm2, 60.0 * 40.0);
  EXPECT_NEAR(std::abs(face.normal.dot(Vector3d(0.0, std::sin(0.25), std::cos(0.25)))), 1.0, 1e-6);
}

TEST(Planes, ABowedFaceHasAFlatnessErrorOfItsBow) {
  const auto found = measure(plate(0.05), {.kind = Kind::plane});
  ASSERT_TRUE(found) << found.error().message;
  double reach = 0.0;
  for (const auto& p : found->features.at(0).points) reach = std::max(reach, std::abs(p.x()));
  EXPECT_GT(reach, 22.0);
  const double bow = 0.05 * reach * reach / (30.0 * 30.0);
  EXPECT_NEAR(found->features.at(0).fit.range_all_mm(), bow, 0.0015);
  EXPECT_NEAR(found->results[0].value_mm, bow, 0.002);
}

TEST(Planes, AFaceIsFoundWhereverItIsInSpace) {
  const Mesh plain = plate(0.0);
  for (int k = 1; k <= 5; ++k) {
    Mesh mesh = plain;
    for (auto& v : mesh.vertices) v += static_cast<float>(k) * Eigen::Vector3f(0.3F, -0.2F, 0.75F);
    const auto found = measure(mesh, {.kind = Kind::plane});
    ASSERT_TRUE(found) << k << ": " << found.error().message;
    EXPECT_NEAR(found->results[0].value_mm, 0.0, 1e-4);
    EXPECT_GT(found->features.at(0).area_mm2, 0.5 * 60.0 * 40.0);
  }
}

TEST(Planes, ABallHasNoFlatFace) {
  const auto found = measure(artefact_mesh::ball_on_stem(14.0), {.kind = Kind::plane});
  // The foot of the stem has faces of 4 to 7 mm height, which are no 5 % of all; its top has.
  ASSERT_TRUE(found);
  const auto ball = artefact_mesh::model(
      [](const Vector3d& p) {
        return artefact_mesh::ball(p, {0, 20, 0}, 14.0);
      },
      {-15, 5, -15}, {15, 35, 15});
  const auto none = measure(ball, {.kind = Kind::plane});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
}

/// Steps of 20 x 12 mm at these heights, turned.
Mesh steps(const std::vector<double>& heights, double cell = artefact_mesh::kCellMm) {
  const Eigen::AngleAxisd upright(0.4, Vector3d(1.0, 2.0, -1.0).normalized());
  const auto field = [&](const Vector3d& p) {
    const Vector3d q = upright * p;
    double inside = 1e9;
    for (std::size_t k = 0; k < heights.size(); ++k) {
      const double x = 20.0 * (static_cast<double>(k) - 0.5 * static_cast<double>(heights.size()));
      inside = std::min(inside, box(q, {x, -14.0, -3.0}, {x + 20.0, 14.0, heights[k]}));
    }
    return inside;
  };
  return artefact_mesh::model(field, Vector3d::Constant(-50.0), Vector3d::Constant(50.0), cell);
}

TEST(Planes, StepsHaveTheErrorsOfTheirHeights) {
  const Artefact gauge{.kind = Kind::step_gauge, .heights_mm = {5.0, 15.0, 25.0}};
  const auto found = measure(steps({0.0, 15.012, 5.0, 24.98}), gauge);
  ASSERT_TRUE(found) << found.error().message;
  const double errors[] = {0.0, 0.012, -0.020};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(found->results[k].name, "step");
    EXPECT_EQ(found->results[k].feature, fmt::format("step {}", k + 1));
    EXPECT_NEAR(found->results[k].value_mm, errors[k], 2e-4);
  }
  EXPECT_EQ(found->features.size(), 4U);
  EXPECT_NEAR(
      found->features[0].normal.dot(Eigen::AngleAxisd(-0.4, Vector3d(1.0, 2.0, -1.0).normalized()) * Vector3d::UnitZ()),
      1.0, 1e-6);
}

TEST(Planes, TheUncertaintyOfAStepHoldsForErrorsThatAreAlike) {
  const Mesh clean = steps({0.0, 5.0}, 0.8);
  double squares = 0.0, stated = 0.0;
  constexpr int kTrials = 12;
  for (int trial = 0; trial < kTrials; ++trial) {
    Mesh mesh = clean;
    mesh.sigma.assign(mesh.vertices.size(), 0.01F);
    artefact_mesh::move_along_normals(mesh,
                                      artefact_mesh::errors(mesh, 0.01, 1.0, static_cast<std::uint32_t>(7 + trial)));
    const auto found = measure(mesh, {.kind = Kind::step_gauge, .heights_mm = {5.0}});
    ASSERT_TRUE(found) << found.error().message;
    squares += found->results[0].value_mm * found->results[0].value_mm / kTrials;
    stated += 0.5 * found->results[0].expanded_uncertainty_mm / kTrials;
  }
  const double ratio = std::sqrt(squares) / stated;
  EXPECT_GT(ratio, 0.45);
  EXPECT_LT(ratio, 1.6);
}

TEST(Planes, OtherHeightsAreNotFound) {
  const auto found = measure(steps({0.0, 15.0, 5.0}), {.kind = Kind::step_gauge, .heights_mm = {5.0, 12.0}});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::not_found);
  EXPECT_THAT(found.error().message, HasSubstr("heights of 5.000, 12.000 mm"));
}

}  // namespace
}  // namespace scanrig::acceptance
