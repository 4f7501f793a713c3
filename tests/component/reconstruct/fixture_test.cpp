// Objects on putty and pins through the whole reconstruction, as synthetic range images.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pipeline/mesh/surface_index.h"
#include "pipeline/reconstruct/reconstruct.h"
#include "pipeline/volume/integrate.h"
#include "tests/unit/pipeline/pose/held_solids.h"

namespace scanrig {
namespace {

using testing::held;
using testing::HeldPose;
using testing::Holder;

constexpr double kVoxelMm = 0.7;
const testing::RigModel kFixtureRig{.width = 260, .height = 210, .focal_px = 1000, .noise_mm = 0.01};

Eigen::Matrix3d tilt(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(to_radians(degrees), axis.normalized()).toRotationMatrix();
}

using Scans = std::vector<std::vector<View>>;

Scans scans_of(std::span<const HeldPose> poses) {
  Scans scans;
  for (const HeldPose& pose : poses) {
    const auto seed = static_cast<unsigned>(scans.size()) + 1;
    scans.push_back(testing::turn_around(testing::bounded(pose.all(), {0, 35, 0}, 75), 8, kFixtureRig, seed));
  }
  return scans;
}

Result<Model> model_of(const Scans& scans, bool fixture) {
  ReconstructOptions options;
  options.voxel_mm = kVoxelMm;
  options.fixture = fixture;
  Reconstruction reconstruction(options);
  for (std::size_t p = 0; p < scans.size(); ++p) {
    for (const View& view : scans[p]) {
      if (auto added = reconstruction.add_range_view(p, view.index, view.angle_rad, view.range, {}); !added) {
        return pass_on(added);
      }
    }
    if (auto done = reconstruction.finish_pose(p, {}); !done) return pass_on(done);
  }
  return reconstruction.finish({}, {});
}

Transform transform_in(const nlohmann::json& json) {
  Transform t = Transform::Identity();
  for (int r = 0; r < 3; ++r) {
    t.translation()[r] = json["translation"][r];
    for (int c = 0; c < 3; ++c) t.linear()(r, c) = json["rotation"][r][c];
  }
  return t;
}

/// model_from_pose, as the solids were placed.
Transform placed(std::span<const HeldPose> poses, std::size_t p) {
  return poses[0].pose_from_object * poses[p].pose_from_object.inverse();
}

struct PoseError {
  double deg = 0.0, mm = 0.0;
};

PoseError pose_error(const Model& model, std::span<const HeldPose> poses, std::size_t p) {
  const Transform truth = placed(poses, p);
  const Transform found = transform_in((*model.report)[fmt::format("pose1_from_pose{}", p + 1)]);
  const Eigen::Vector3d middle = poses[p].pose_from_object * Eigen::Vector3d(0, 30, 0);
  return {to_degrees(rotation_angle(found.linear().transpose() * truth.linear())),
          (found * middle - truth * middle).norm()};
}

/// What the model would be if all of the fixtures and nothing else were taken out of the range images, with the true
/// poses.
Mesh ideal_model(const Scans& scans, std::span<const HeldPose> poses) {
  Scans clean = scans;
  std::vector<PosedViews> posed;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    for (View& view : clean[p]) {
      RangeImage& range = view.range;
      range.depth = range.depth.clone();
      const Transform pose_from_camera = range.camera_from_pose.inverse();
      for (int v = 0; v < range.depth.rows; ++v) {
        for (int u = 0; u < range.depth.cols; ++u) {
          float& depth = range.depth(v, u);
          if (std::isnan(depth)) continue;
          if (poses[p].object(pose_from_camera * range.projection.unproject(u, v, depth)) > 0.1) depth = kUnmeasured;
        }
      }
    }
    posed.push_back({.views = clean[p], .model_from_pose = placed(poses, p)});
  }
  auto surface = integrate(posed, {.voxel_mm = kVoxelMm});
  return surface ? std::move(surface->mesh) : Mesh{};
}

/// Faces off the object, in a fixture or at its surface, that are measured or that the ideal model does not have: where
/// no pose looks under the object, that is closed there too.
std::size_t fixture_faces(const Mesh& mesh, const Mesh& ideal, std::span<const HeldPose> poses) {
  const Transform object_from_model = poses[0].pose_from_object.inverse();
  const auto closed_anyway = SurfaceIndex::create(ideal);
  return static_cast<std::size_t>(std::ranges::count_if(mesh.faces, [&](const Mesh::Face& face) {
    const Eigen::Vector3f sum = mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]];
    const Eigen::Vector3d at = (sum / 3.0F).cast<double>();
    const auto is_in = [&](const HeldPose& pose) {
      return pose.fixture && pose.fixture(pose.pose_from_object * object_from_model * at) < 0.25;
    };
    if (poses[0].object(at) < 0.4 || std::ranges::none_of(poses, is_in)) return false;
    const bool is_measured = std::ranges::all_of(face, [&](std::uint32_t v) { return mesh.views[v] > 0; });
    return closed_anyway->nearest(at, 4.0).distance > (is_measured ? 1.0 : 2.0) * kVoxelMm;
  }));
}

/// Share of the ideal model's measured surface that the model has not measured.
double lost_share(const Mesh& mesh, const Mesh& ideal) {
  const auto measured = SurfaceIndex::create(mesh, measured_faces(mesh, true));
  std::size_t all = 0, lost = 0;
  for (std::size_t i = 0; i < ideal.vertices.size(); ++i) {
    if (ideal.views[i] == 0) continue;
    ++all;
    lost += measured->nearest(ideal.vertices[i].cast<double>(), 3.0).distance > kVoxelMm ? 1 : 0;
  }
  return static_cast<double>(lost) / static_cast<double>(all);
}

/// Object `i` of ten: putty and pins by turns, another tilt for each, turned over; every third has nothing in pose 2.
std::vector<HeldPose> held_twice(int i) {
  const auto solid = testing::lopsided_solids()[static_cast<std::size_t>(i)].solid;
  const Holder holder = i % 2 == 0 ? Holder::putty : Holder::pins;
  const Holder second = i % 3 == 2 ? Holder::none : holder;
  const Eigen::Matrix3d turn = tilt(17.0 + 5.0 * i, {1.0, 0.3 * i, -0.5});
  const Eigen::Matrix3d over = tilt(40.0 * i, {0, 1, 0}) * tilt(125.0 + 5.0 * i, {1.0, 0.0, 0.4 * i - 2.0});
  return {held(solid, turn, holder, 6.0 + i % 4), held(solid, over * turn, second, second == Holder::none ? 0.0 : 7.0)};
}

class OnFixtures : public ::testing::TestWithParam<int> {};

TEST_P(OnFixtures, PosesAreFoundAndNothingOfTheFixtureIsLeft) {
  const auto poses = held_twice(GetParam());
  const Scans scans = scans_of(poses);
  const auto model = model_of(scans, true);
  ASSERT_TRUE(model) << model.error().message;
  const PoseError error = pose_error(*model, poses, 1);
  const Mesh &mesh = model->mesh.mesh, ideal = ideal_model(scans, poses);
  EXPECT_LT(error.deg, 0.015);
  EXPECT_LT(error.mm, 0.015);
  EXPECT_EQ(fixture_faces(mesh, ideal, poses), 0U);
  EXPECT_LT(lost_share(mesh, ideal), 0.01);
  const auto& fixtures = (*model->report)["fixtures"];
  ASSERT_EQ(fixtures.size(), poses[1].fixture ? 2U : 1U);
  EXPECT_EQ(fixtures[0]["pose"], 0);
  EXPECT_GT(fixtures[0]["area_mm2"], 50.0);
  EXPECT_GT(fixtures[0]["height_mm"], 5.0);
}

INSTANTIATE_TEST_SUITE_P(TenObjects, OnFixtures, ::testing::Range(0, 10));

TEST(Fixtures, AreFoundWithoutTheKeyAndTheRemarkAsksForIt) {
  const auto poses = held_twice(0);
  const Scans scans = scans_of(poses);
  const auto model = model_of(scans, false);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_LT(pose_error(*model, poses, 1).mm, 0.015);
  EXPECT_EQ(fixture_faces(model->mesh.mesh, ideal_model(scans, poses), poses), 0U);
  EXPECT_EQ((*model->report)["fixtures"].size(), 2U);
  const auto& remark = (*model->report)["disagreements"][0];
  EXPECT_EQ(remark["what"], "fixture");
  EXPECT_EQ(remark["action"], "left out");
  EXPECT_THAT(remark["sentence"].get<std::string>(),
              ::testing::AllOf(::testing::HasSubstr("In pose 1 the part stood on a fixture"),
                               ::testing::HasSubstr("fixture = true")));
}

TEST(Fixtures, OfThreePosesAreFound) {
  auto poses = held_twice(4);
  const auto solid = testing::lopsided_solids()[4].solid;
  poses.push_back(held(solid, tilt(80, {0.2, 0.3, 1}), Holder::pins, 8.0));
  const Scans scans = scans_of(poses);
  const auto model = model_of(scans, true);
  ASSERT_TRUE(model) << model.error().message;
  for (const std::size_t p : {1U, 2U}) {
    EXPECT_LT(pose_error(*model, poses, p).deg, 0.015) << p;
    EXPECT_LT(pose_error(*model, poses, p).mm, 0.015) << p;
  }
  EXPECT_EQ((*model->report)["fixtures"].size(), 3U);
  EXPECT_EQ(fixture_faces(model->mesh.mesh, ideal_model(scans, poses), poses), 0U);
}

TEST(Fixtures, AreNotFoundUnderAnObjectOnTheTable) {
  const auto solid = testing::lopsided_solids()[0].solid;
  const std::vector<HeldPose> poses = {held(solid, Eigen::Matrix3d::Identity(), Holder::none, 0.0),
                                       held(solid, tilt(90, {0, 0, 1}), Holder::none, 0.0)};
  const Scans scans = scans_of(poses);
  const auto model = model_of(scans, false), expecting = model_of(scans, true);
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_TRUE(expecting) << expecting.error().message;
  for (const auto* found : {&model, &expecting}) {
    EXPECT_TRUE((*(*found)->report)["fixtures"].empty());
    EXPECT_TRUE((*(*found)->report)["disagreements"].empty());
    EXPECT_LT(pose_error(**found, poses, 1).mm, 0.015);
  }
  EXPECT_EQ((*expecting->report)["pose_estimate"]["chosen"]["generator"], "point pairs");
}

TEST(Fixtures, OfASinglePoseStayInTheModelAndTheRemarkNamesIt) {
  const auto poses = held_twice(0);
  const auto model = model_of({testing::turn_around(poses[0].all(), 8, kFixtureRig)}, true);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_TRUE((*model->report)["fixtures"].empty());
  EXPECT_THAT((*model->report)["disagreements"][0]["sentence"].get<std::string>(),
              ::testing::HasSubstr("its fixture is part of the model"));
}

}  // namespace
}  // namespace scanrig
