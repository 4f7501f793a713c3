#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "pipeline/acceptance/acceptance.h"
#include "tests/unit/pipeline/acceptance/artefact_mesh.h"

namespace scanrig::acceptance {
namespace {

using artefact_mesh::ball_on_stem;
using artefact_mesh::kCentre;
using Eigen::Vector3d;
using testing::HasSubstr;

const Artefact kSphere{.kind = Kind::sphere, .diameter_mm = 25.0};

Acceptance measured(const Mesh& mesh, const Artefact& artefact = kSphere) {
  auto found = measure(mesh, artefact);
  EXPECT_TRUE(found) << found.error().message;
  return found ? *found : Acceptance{};
}

const AcceptanceResult& result(const Acceptance& found, const std::string& name) {
  static const AcceptanceResult kNone{.value_mm = 1e9};
  for (const auto& one : found.results) {
    if (one.name == name) return one;
  }
  ADD_FAILURE() << "no result " << name;
  return kNone;
}

TEST(Sphere, APerfectOneOnAStemHasNoErrors) {
  const auto found = measured(ball_on_stem(12.5));
  EXPECT_NEAR(result(found, "form").value_mm, 0.0, 1e-4);
  EXPECT_NEAR(result(found, "size").value_mm, 0.0, 1e-4);
  const Feature& sphere = found.features.at(0);
  EXPECT_NEAR((sphere.centre - kCentre).norm(), 0.0, 1e-4);
  EXPECT_GT(sphere.at_rim, 0U);
  // All but the stem, of 3 mm, and a rim of ten edges around it.
  EXPECT_GT(*sphere.seen_share, 0.8);
  EXPECT_LT(*sphere.seen_share, 1.0 - 0.25 * 3.0 * 3.0 / (12.5 * 12.5));
}

TEST(Sphere, ALobedOneHasTheFormErrorOfItsLobes) {
  // sin^2(polar) cos(2 azimuth) is neither a shift nor a size: a Gauss fit leaves it whole.
  const auto found =
      measured(ball_on_stem([](const Vector3d& u) { return 12.5 + 0.020 * (u.x() * u.x() - u.z() * u.z()); }));
  // The 3 of 1000 farthest points are the tips of the lobes.
  EXPECT_NEAR(result(found, "form").value_mm, 0.040, 0.001);
  EXPECT_NEAR(found.features.at(0).fit.range_all_mm(), 0.040, 0.0002);
  EXPECT_NEAR(result(found, "size").value_mm, 0.0, 0.003);
}

TEST(Sphere, ALargerOneHasASizeErrorWithItsSign) {
  EXPECT_NEAR(result(measured(ball_on_stem(12.515)), "size").value_mm, 0.030, 1e-4);
  EXPECT_NEAR(result(measured(ball_on_stem(12.485)), "size").value_mm, -0.030, 1e-4);
}

/// Moves some of the points of the upper half outwards: every `step`-th, with its neighbours left as they are.
Mesh with_outliers(std::size_t step, float by_mm) {
  Mesh mesh = ball_on_stem(12.5);
  std::size_t on_ball = 0;
  for (auto& v : mesh.vertices) {
    const Eigen::Vector3f away = v - kCentre.cast<float>();
    if (away.y() < -6.0F || std::abs(away.norm() - 12.5F) > 1e-3F) continue;
    if (++on_ball % step == 0) v += by_mm * away.normalized();
  }
  return mesh;
}

TEST(Sphere, ThreeOfAThousandPointsAreLeftOutButNotMore) {
  const auto few = measured(with_outliers(600, 0.3F));  // 1.3 of 1000 of all points
  EXPECT_LT(result(few, "form").value_mm, 0.002);
  EXPECT_NEAR(few.features.at(0).fit.range_all_mm(), 0.3, 0.002);
  EXPECT_GE(few.features.at(0).fit.left_out.size(), 10U);
  EXPECT_LT(few.features.at(0).fit.range_95_mm(), 0.002);
  EXPECT_NEAR(result(measured(with_outliers(100, 0.3F)), "form").value_mm, 0.3, 0.01);
}

/// A bump of 1.5 mm, beyond the band and steep all around, as wide as this to all sides of its middle.
Mesh with_bump(double half_width_mm) {
  Mesh mesh = ball_on_stem(12.5);
  const auto min_cosine = static_cast<float>(std::cos(half_width_mm / 12.5));
  for (auto& v : mesh.vertices) {
    const Eigen::Vector3f away = v - kCentre.cast<float>();
    if (away.norm() < 13.0F && away.normalized().z() > min_cosine) v += 1.5F * away.normalized();
  }
  return mesh;
}

TEST(Sphere, ABumpBeyondTheBandIsAnErrorNotOtherSurface) {
  const auto found = measured(with_bump(1.7));
  ASSERT_EQ(found.features.size(), 1U);
  EXPECT_NEAR((found.features[0].centre - kCentre).norm(), 0.0, 0.05);
  EXPECT_NEAR(result(found, "form").value_mm, 1.5, 0.1);
}

TEST(Sphere, IsFoundWhereverItIsInSpace) {
  const Mesh bumped = with_bump(1.7);
  for (int k = 1; k <= 4; ++k) {
    const Vector3d shift = k * Vector3d(0.57, -0.83, 1.31);
    Mesh mesh = bumped;
    for (auto& v : mesh.vertices) v += shift.cast<float>();
    const auto found = measured(mesh);
    ASSERT_EQ(found.features.size(), 1U) << shift.transpose();
    EXPECT_NEAR((found.features[0].centre - kCentre - shift).norm(), 0.0, 0.05);
  }
}

TEST(Sphere, ABumpWiderThanARimIsOtherSurfaceAndMissingFromTheSeenShare) {
  const auto found = measured(with_bump(6.0));
  EXPECT_LT(result(found, "form").value_mm, 0.01);
  const double with_rim = 0.5 * (1.0 - std::cos((6.0 + 3.0) / 12.5));
  EXPECT_LT(*found.features.at(0).seen_share, *measured(ball_on_stem(12.5)).features.at(0).seen_share - 0.9 * with_rim);
}

TEST(Sphere, UnmeasuredSurfaceNeverCounts) {
  Mesh mesh = ball_on_stem(12.5);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f away = mesh.vertices[i] - kCentre.cast<float>();
    if (away.z() > -3.0F) continue;
    mesh.views[i] = 0;
    mesh.sigma[i] = std::nanf("");
    mesh.vertices[i] += 0.2F * away.normalized();
  }
  const auto found = measured(mesh);
  EXPECT_NEAR(result(found, "form").value_mm, 0.0, 1e-4);
  EXPECT_NEAR(result(found, "size").value_mm, 0.0, 1e-4);
  EXPECT_NEAR(*found.features.at(0).seen_share, 0.62 - 0.06, 0.05);  // (1 + 3 / 12.5) / 2, less the stem
}

TEST(Sphere, AFileOfSingleTrianglesIsOneSurface) {
  const Mesh& mesh = ball_on_stem(12.51);
  Mesh triangles;
  for (const auto& face : mesh.faces) {
    const auto first = static_cast<std::uint32_t>(triangles.vertices.size());
    for (const std::uint32_t v : face) triangles.vertices.push_back(mesh.vertices[v]);
    triangles.faces.push_back({first, first + 1, first + 2});
  }
  const auto found = measured(triangles);
  EXPECT_NEAR(result(found, "size").value_mm, 0.020, 1e-4);
  EXPECT_EQ(found.features.at(0).points.size(), measured(mesh).features.at(0).points.size());
}

TEST(Sphere, TooLittleOfItIsRefusedWithTheShareThatIsNeeded) {
  Mesh mesh = ball_on_stem(12.5);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) mesh.views[i] = mesh.vertices[i].y() > 33.0F ? 2 : 0;
  const auto found = measure(mesh, kSphere);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::degenerate);
  // (1 - 5 / 12.5) / 2 is seen.
  EXPECT_THAT(found.error().message,
              testing::ContainsRegex("only (29|30) % of the sphere of 25.000 mm is measured, 50 % are needed"));
  mesh.views.assign(mesh.vertices.size(), 0);
  const auto nothing = measure(mesh, kSphere);
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::degenerate);
}

TEST(Sphere, OfAnotherDiameterIsNotTaken) {
  const auto near = measure(ball_on_stem(13.1), kSphere);
  ASSERT_FALSE(near);
  EXPECT_EQ(near.error().code, ErrorCode::not_found);
  EXPECT_THAT(near.error().message, HasSubstr("no sphere of 25.000 mm: the nearest one has 26.200 mm"));
  const auto far = measure(ball_on_stem(9.0), kSphere);
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::not_found);
}

TEST(Sphere, IsFoundBesideLargerBodies) {
  using artefact_mesh::ball;
  const Vector3d centre(0.0, 40.0, 0.0);
  const auto field = [&](const Vector3d& p) {
    return std::min({ball(p, centre, 5.0), ball(p, {30.0, 20.0, 0.0}, 9.0),
                     artefact_mesh::box(p, {-25.0, 0.0, -25.0}, {-12.0, 55.0, 25.0})});
  };
  const auto found =
      measured(artefact_mesh::model(field, {-26, -1, -26}, {40, 56, 26}), {.kind = Kind::sphere, .diameter_mm = 10.0});
  EXPECT_NEAR((found.features.at(0).centre - centre).norm(), 0.0, 1e-4);
}

TEST(Sphere, ABallBarHasTheErrorOfItsSpacing) {
  using artefact_mesh::ball;
  const Vector3d a(-30.0, 20.0, 0.0), b = a + 70.04 * Vector3d(0.8, 0.6, 0.0);
  const auto field = [&](const Vector3d& p) {
    return std::min({ball(p, a, 10.0), ball(p, b, 10.0), artefact_mesh::rod(p, a, b, 3.0)});
  };
  const Mesh mesh = artefact_mesh::model(field, {-42, 8, -12}, {38, 74, 12});
  Artefact bar{.kind = Kind::ball_bar, .diameter_mm = 20.0, .length_mm = 70.0};
  const auto found = measured(mesh, bar);
  EXPECT_NEAR(result(found, "spacing").value_mm, 0.04, 1e-4);
  EXPECT_EQ(found.features.size(), 2U);
  for (const auto& one : found.results) {
    if (one.name == "spacing") continue;
    EXPECT_NEAR(one.value_mm, 0.0, 1e-4) << one.name << one.feature;
  }
  bar.length_mm = 80.0;
  const auto other = measure(mesh, bar);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::not_found);
  EXPECT_THAT(other.error().message, HasSubstr("those found are 70.040 mm apart"));
  const auto one_ball = measure(ball_on_stem(10.0), bar);
  ASSERT_FALSE(one_ball);
  EXPECT_EQ(one_ball.error().code, ErrorCode::not_found);
  EXPECT_THAT(one_ball.error().message, HasSubstr("no second sphere of 20.000 mm"));
}

/// Actual standard deviation of the size by what is stated, over many errors of measurement.
double actual_by_stated(double alike_mm, double stated_sigma, int trials) {
  const Mesh clean = artefact_mesh::model([](const Vector3d& p) { return artefact_mesh::ball(p, kCentre, 6.0); },
                                          kCentre - Vector3d::Constant(7.0), kCentre + Vector3d::Constant(7.0), 0.5);
  double squares = 0.0, stated = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    Mesh mesh = clean;
    mesh.sigma.assign(mesh.vertices.size(), static_cast<float>(stated_sigma));
    artefact_mesh::move_along_normals(
        mesh, artefact_mesh::errors(mesh, 0.01, alike_mm, static_cast<std::uint32_t>(100 + trial)));
    const auto found = measured(mesh, {.kind = Kind::sphere, .diameter_mm = 12.0});
    const auto& size = result(found, "size");
    squares += size.value_mm * size.value_mm / trials;
    stated += 0.5 * size.expanded_uncertainty_mm / trials;
  }
  return std::sqrt(squares) / stated;
}

TEST(Sphere, TheUncertaintyOfItsSizeHoldsForIndependentErrors) {
  const double ratio = actual_by_stated(0.0, 0.01, 24);
  EXPECT_GT(ratio, 0.7);
  EXPECT_LT(ratio, 1.3);
}

TEST(Sphere, TheUncertaintyOfItsSizeHoldsForErrorsThatAreAlike) {
  // As if they were independent it would be several times too small.
  const double ratio = actual_by_stated(0.8, 0.01, 16);
  EXPECT_GT(ratio, 0.6);
  EXPECT_LT(ratio, 1.5);
}

TEST(Sphere, TheUncertaintyFollowsTheResidualsWhereSigmaIsTooSmall) {
  const double ratio = actual_by_stated(0.0, 0.001, 16);
  EXPECT_GT(ratio, 0.6);
  EXPECT_LT(ratio, 1.5);
}

TEST(Sphere, TheArtefactsOwnUncertaintyIsInEveryResult) {
  Artefact artefact = kSphere;
  const Mesh& mesh = ball_on_stem(12.5);
  const auto without = measured(mesh, artefact);
  artefact.expanded_uncertainty_mm = 0.05;
  const auto with = measured(mesh, artefact);
  for (std::size_t i = 0; i < with.results.size(); ++i) {
    EXPECT_NEAR(with.results[i].expanded_uncertainty_mm, std::hypot(0.05, without.results[i].expanded_uncertainty_mm),
                1e-9);
  }
}

}  // namespace
}  // namespace scanrig::acceptance
