#include "pipeline/evaluate/evaluate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "core/parallel.h"
#include "pipeline/model_io/model_files.h"
#include "tests/unit/pipeline/evaluate/ball_truth.h"

namespace scanrig {
namespace {

using namespace ball_truth;

EvaluateOptions quick() {
  EvaluateOptions options;
  options.samples = 10'000;
  options.carve_voxel_mm = 1.0;
  return options;
}

Claim claim_of(Mesh mesh) {
  Claim claim;
  claim.model.mesh = std::move(mesh);
  return claim;
}

Scores score(Mesh model, const Truth& truth = rig_and_ball({0.0, 180.0}), const EvaluateOptions& options = quick()) {
  const auto scores = evaluate(claim_of(std::move(model)), truth, nullptr, options, {});
  EXPECT_TRUE(scores) << scores.error().message;
  return scores.value_or(Scores{});
}

TEST(Evaluate, TheTruthItselfIsFaultless) {
  const Scores scores = score(ball());
  EXPECT_LT(scores.measured.p95, 1e-5);
  EXPECT_EQ(scores.measured.share_over_025, 0.0);
  EXPECT_NEAR(scores.measured.area_mm2, 4.0 * std::numbers::pi * kRadius * kRadius, 5.0);
  EXPECT_EQ(scores.covered_010, 1.0);
  EXPECT_EQ(scores.closed_share, 0.0);
  EXPECT_LT(scores.normal_p95_deg, 0.1);
  EXPECT_TRUE(scores.watertight);
  EXPECT_EQ(scores.genus, 0);
  EXPECT_EQ(scores.components, 1u);
  EXPECT_EQ(scores.self_intersections, 0u);
  for (const Gate& gate : gates(scores)) EXPECT_TRUE(gate.ok()) << gate.name;
}

TEST(Evaluate, ALargerBallIsOffByTheDifferenceOfRadii) {
  const Scores scores = score(ball(kRadius + 0.12));
  EXPECT_NEAR(scores.measured.median, 0.12, 0.005);
  EXPECT_NEAR(scores.measured.p95, 0.12, 0.005);
  EXPECT_EQ(scores.covered_010, 0.0);
  EXPECT_EQ(scores.covered_015, 1.0);
  EXPECT_EQ(scores.measured.share_over_025, 0.0);
}

// Shifted by s, a ball's surface is off by s |cos|, and |cos| is spread evenly over 0..1.
TEST(Evaluate, AShiftCountsInTheAbsoluteFrameAndGoesAwayWhenAligned) {
  const Scores scores = score(ball(kRadius, kCentre + Eigen::Vector3d(0.24, 0.0, 0.32)));
  EXPECT_NEAR(scores.measured.median, 0.20, 0.005);
  EXPECT_NEAR(scores.measured.p95, 0.38, 0.005);
  EXPECT_NEAR(scores.measured.share_over_025, 0.375, 0.01);
  EXPECT_LT(scores.aligned.p95, 0.01);
  EXPECT_NEAR(scores.alignment_mm, 0.4, 0.01);
}

TEST(Evaluate, FewClaimsCoverLittle) {
  Mesh model = ball();
  for (std::size_t i = 0; i < model.vertices.size(); ++i) model.views[i] = model.vertices[i].z() >= 0.0F ? 1 : 0;
  const Scores scores = score(model);
  EXPECT_LT(scores.measured.p95, 1e-5);
  EXPECT_NEAR(scores.closed_share, 0.5, 0.01);
  EXPECT_NEAR(scores.covered_010, 0.5, 0.01) << "both views see as much, one on each side";
  EXPECT_FALSE(gates(scores)[2].ok());
}

TEST(Evaluate, ManyClaimsAreFalseClaims) {
  Mesh model = ball();
  // The lower third is flattened, as a hull might close it, yet called measured.
  for (auto& v : model.vertices) v.y() = std::max(v.y(), static_cast<float>(kCentre.y() - kRadius / 3.0));
  const Scores scores = score(model);
  EXPECT_GT(scores.measured.share_over_025, 0.2);
  for (std::size_t i = 0; i < model.vertices.size(); ++i) {
    if (model.vertices[i].y() < kCentre.y() - kRadius / 3.0 + 1e-3) model.views[i] = 0;
  }
  EXPECT_LT(score(model).measured.share_over_025, 0.01);
}

TEST(Evaluate, NothingClaimedIsNothingCovered) {
  Mesh model = ball();
  model.views.assign(model.vertices.size(), 0);
  const Scores scores = score(model);
  EXPECT_EQ(scores.covered_010, 0.0);
  EXPECT_EQ(scores.closed_share, 1.0);
  EXPECT_TRUE(std::isnan(scores.measured.median));
  EXPECT_FALSE(gates(scores)[0].ok());
}

// Under a ball seen from all sides at elevation e the cones that graze it leave a tip. Its sides stand off the point of
// the ball that lies an angle d from the lowest by R - R cos(e + asin(R / D) - d).
TEST(Evaluate, ClosedAreaIsComparedWithTheIdealCarve) {
  Truth truth = rig_and_ball({0, 45, 90, 135, 180, 225, 270, 315});
  Mesh model = ball();
  for (std::size_t i = 0; i < model.vertices.size(); ++i) {
    const Eigen::Vector3d direction = (model.vertices[i].cast<double>() - kCentre).normalized();
    model.views[i] = direction.y() < -0.999 ? 0 : 1;
  }
  EvaluateOptions fine = quick();
  fine.carve_voxel_mm = 0.5;
  // Two rings of faces, 3.6 degrees.
  const double half_of_area = to_radians(3.6) / std::sqrt(2.0);
  const double grazing = to_radians(22.0) + std::asin(kRadius / 640.0);
  EXPECT_NEAR(score(model, truth, fine).closed.median, kRadius - kRadius * std::cos(grazing - half_of_area), 0.05);
  // A belt above the middle, where free space leaves the ball itself.
  truth.poses[0].angles_deg = {0, 90, 180, 270};
  for (std::size_t i = 0; i < model.vertices.size(); ++i) {
    const double height = (model.vertices[i].cast<double>() - kCentre).normalized().y();
    model.views[i] = height > 0.2 && height < 0.8 ? 0 : 1;
  }
  EXPECT_LT(score(model, truth, fine).closed.p95, 0.05);
}

TEST(Evaluate, TurnedFacesAreNoticed) {
  Mesh model = ball();
  for (auto& face : model.faces) std::swap(face[1], face[2]);
  EXPECT_EQ(score(model).flipped_share, 1.0);
}

TEST(Evaluate, SigmaIsHonestWhenErrorsAreAsLargeAsSigma) {
  Mesh model = ball(kRadius + 0.0337);
  model.sigma.assign(model.vertices.size(), 0.05F);
  const Scores honest = score(model);
  EXPECT_NEAR(honest.sigma_ratio, 1.0, 0.05);
  EXPECT_EQ(honest.beyond_2_sigma, 0.0);
  model.sigma.assign(model.vertices.size(), 0.01F);
  const Scores boasting = score(model);
  EXPECT_NEAR(boasting.sigma_ratio, 5.0, 0.2);
  EXPECT_EQ(boasting.beyond_3_sigma, 1.0);
}

const SigmaClass* class_of(const Scores& scores, const std::string& name) {
  const auto found = std::ranges::find(scores.sigma_classes, name, &SigmaClass::name);
  return found == scores.sigma_classes.end() ? nullptr : &*found;
}

/// A ball in which every vertex is off along its normal by so many of its sigmas.
Mesh wavy_ball(const std::function<double(const Eigen::Vector3d&)>& sigmas_off, float sigma) {
  Mesh model = ball();
  for (auto& vertex : model.vertices) {
    const Eigen::Vector3d outward = (vertex.cast<double>() - kCentre).normalized();
    vertex += (static_cast<double>(sigma) * sigmas_off(outward) * outward).cast<float>();
  }
  model.sigma.assign(model.vertices.size(), sigma);
  return model;
}

TEST(Evaluate, SigmaIsJudgedByClassAndAfterAlignment) {
  Mesh model =
      wavy_ball([](const Eigen::Vector3d& n) { return std::sin(40.0 * n.x()) * (n.y() > 0.0 ? 1.0 : 3.0); }, 0.02F);
  for (std::size_t v = 0; v < model.vertices.size(); ++v) {
    model.views[v] = static_cast<double>(model.vertices[v].y()) > kCentre.y() ? 7 : 2;
    model.vertices[v] += Eigen::Vector3f(0.3F, 0.0F, 0.1F);
  }
  const Scores scores = score(model);
  const SigmaClass *many = class_of(scores, "5 views and more"), *two = class_of(scores, "2 views");
  ASSERT_TRUE(many && two);
  EXPECT_NEAR(two->ratio / many->ratio, 3.0, 0.3);
  EXPECT_EQ(many->within_2, 1.0);
  EXPECT_LT(two->within_2, 0.6);
  EXPECT_EQ(class_of(scores, "1 view"), nullptr);
  const SigmaClass* curved = class_of(scores, kRadius < 20.0 ? "radius 5 to 20 mm" : "radius over 20 mm");
  ASSERT_TRUE(curved);
  EXPECT_EQ(curved->count, class_of(scores, "all")->count);
}

TEST(Evaluate, DistancesAreJudgedByTheSigmaOfBothEnds) {
  const auto noise = [](const Eigen::Vector3d& n) { return std::sin(997.0 * n.x() + 389.0 * n.y()); };
  const SigmaClass* honest = nullptr;
  const Scores scores = score(wavy_ball(noise, 0.02F));
  honest = class_of(scores, "distances 20 to 80 mm");
  ASSERT_TRUE(honest);
  EXPECT_GT(honest->count, 1000U);
  EXPECT_GT(honest->ratio, 0.3) << "waves vary less between vertices than noise";
  EXPECT_LT(honest->ratio, 1.0);
  Mesh boasting = wavy_ball(noise, 0.02F);
  boasting.sigma.assign(boasting.vertices.size(), 0.004F);
  const Scores less = score(boasting);
  EXPECT_NEAR(class_of(less, "distances 20 to 80 mm")->ratio / honest->ratio, 5.0, 0.1);
}

TEST(Evaluate, HolesBitsAndCrossingsAreCounted) {
  Mesh model = ball();
  const Mesh other = ball(5.0, kCentre + Eigen::Vector3d(kRadius, 0, 0), 20);
  const auto first = static_cast<std::uint32_t>(model.vertices.size());
  model.vertices.insert(model.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& f : other.faces) model.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  model.views.assign(model.vertices.size(), 1);
  model.faces.erase(model.faces.begin());
  const Scores scores = score(model);
  EXPECT_EQ(scores.components, 2u);
  EXPECT_FALSE(scores.watertight);
  EXPECT_GT(scores.self_intersections, 50u) << "a ring of faces around the smaller ball";
  EXPECT_LT(scores.self_intersections, 1000u);
}

TEST(Evaluate, AnOpenTruthHasNoGenusToCompareWith) {
  Truth truth = rig_and_ball({0.0, 180.0});
  EXPECT_EQ(score(ball(), truth).true_genus, 0);
  truth.mesh.faces.erase(truth.mesh.faces.begin());
  const Scores scores = score(ball(), truth);
  EXPECT_EQ(scores.true_genus, std::nullopt);
  for (const Gate& gate : gates(scores)) EXPECT_NE(gate.name, "genus off");
}

TEST(Evaluate, TheSecondPoseIsComparedWithItsTruth) {
  Truth truth = rig_and_ball({0.0});
  truth.pose1_from_pose2 = Transform::Identity();
  truth.pose1_from_pose2->rotate(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitX())).translate(Eigen::Vector3d(1, 2, 3));
  Claim claim = claim_of(ball());
  // Turned by 0.5 degrees about an axis through the ball's centre, then moved by 0.03 mm.
  claim.pose1_from_pose2 = Eigen::Translation3d(Eigen::Vector3d(0, 0, 0.03) + kCentre) *
                           Eigen::AngleAxisd(to_radians(0.5), Eigen::Vector3d::UnitY()) *
                           Eigen::Translation3d(-kCentre) * *truth.pose1_from_pose2;
  const auto scores = evaluate(claim, truth, nullptr, quick(), {});
  ASSERT_TRUE(scores);
  ASSERT_TRUE(scores->pose2);
  EXPECT_NEAR(scores->pose2->deg, 0.5, 1e-6);
  EXPECT_NEAR(scores->pose2->mm, 0.03, 1e-5);
}

TEST(Evaluate, FurtherPosesAreComparedInTheFrameOfTheFirstThatWasKept) {
  Truth truth = rig_and_ball({0.0});
  for (const double turn : {1.0, 2.0}) {
    TruePose& pose = truth.poses.emplace_back(truth.poses.front());
    pose.table_from_truth = Transform::Identity();
    pose.table_from_truth.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitX())).translate(Eigen::Vector3d(1, 2, 3));
  }
  const Transform pose2_from_truth = truth.poses[1].table_from_truth;
  Claim claim = claim_of(ball());
  claim.frame_of_pose = 1;
  for (auto& v : claim.model.mesh.vertices) v = (pose2_from_truth * v.cast<double>()).cast<float>();
  const Eigen::Vector3d centre = pose2_from_truth * kCentre;
  ClaimedPose third{.pose = 2};
  third.frame_from_pose = Eigen::Translation3d(Eigen::Vector3d(0, 0, 0.03) + centre) *
                          Eigen::AngleAxisd(to_radians(0.5), Eigen::Vector3d::UnitY()) * Eigen::Translation3d(-centre) *
                          pose2_from_truth * truth.poses[2].table_from_truth.inverse();
  third.uncertainty = PoseUncertainty{centre, 1e-4 * Eigen::Matrix<double, 6, 6>::Identity()};
  claim.further_poses = {third};
  const auto scores = evaluate(claim, truth, nullptr, quick(), {});
  ASSERT_TRUE(scores);
  EXPECT_FALSE(scores->pose2);
  ASSERT_EQ(scores->further_poses.size(), 1U);
  EXPECT_NEAR(scores->further_poses[0].error.deg, 0.5, 1e-6);
  EXPECT_NEAR(scores->further_poses[0].error.mm, 0.03, 1e-5);
  EXPECT_NEAR(scores->further_poses[0].error.sigmas, 3.0, 0.01);
  EXPECT_LT(scores->measured.median, 0.01);
  const auto all = gates(*scores);
  const auto gate = std::ranges::find(all, "pose 3, deg", &Gate::name);
  ASSERT_NE(gate, all.end());
  EXPECT_FALSE(gate->ok());
}

TEST(Evaluate, TheResultDoesNotDependOnThreads) {
  Mesh model = ball(kRadius + 0.05, kCentre + Eigen::Vector3d(0.1, 0.0, 0.0));
  for (std::size_t i = 0; i < model.vertices.size(); ++i) model.views[i] = model.vertices[i].y() > 40.0F ? 1 : 0;
  const EvaluateOptions options = quick();
  std::vector<std::string> results;
  for (const int threads : {1, 4}) {
    with_threads(threads, [&] { results.push_back(to_json(score(model, rig_and_ball({0.0}), options)).dump()); });
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(Evaluate, AnUnscorableModelIsNamed) {
  EXPECT_EQ(evaluate(claim_of({}), rig_and_ball({0.0}), nullptr, quick(), {}).error().code, ErrorCode::degenerate);
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_EQ(evaluate(claim_of(ball()), rig_and_ball({0.0}), nullptr, quick(), context).error().code,
            ErrorCode::stopped);
}

TEST(ToTable, FitsATerminal) {
  const std::string table = to_table(score(ball(kRadius + 0.12)));
  std::size_t longest = 0, length = 0;
  for (const char c : table) longest = std::max(longest, length = c == '\n' ? 0 : length + 1);
  EXPECT_LE(longest, 80u);
  EXPECT_NE(table.find("B observable truth covered within 0.1 mm    >=   0.980     0.0000  NO"), std::string::npos)
      << table;
}

}  // namespace
}  // namespace scanrig
