// A rendered scan of three poses; one of another object among them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pipeline/evaluate/evaluate.h"
#include "pipeline/model_io/model_files.h"
#include "pipeline/reconstruct/reconstruct.h"
#include "sim/apps/shoot.h"

namespace scanrig {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kScale = 0.4;
constexpr int kViews = 6;

std::filesystem::path scratch(const char* name) {
  return std::filesystem::path(testing::TempDir()) / fmt::format("scanrig_poses_{}_{}", name, ::getpid());
}

class ManyPoses : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    figurine_ = scratch("figurine");
    gauge_ = scratch("gauge");
    shoot(figurine_, "", 3, 3);
    shoot(gauge_, "step-gauge", 1, 1);
  }
  static void TearDownTestSuite() {
    std::filesystem::remove_all(figurine_);
    std::filesystem::remove_all(gauge_);
  }
  static void shoot(const std::filesystem::path& folder, const char* object, int poses, std::uint64_t seed) {
    std::filesystem::remove_all(folder);
    sim::ShootOptions options;
    options.scene.image_scale = kScale;
    options.scene.object = object;
    options.scene.poses = poses;
    options.scene.seed = seed;
    options.views = kViews;
    const auto shot = sim::shoot(options, folder);
    ASSERT_TRUE(shot) << shot.error().message;
  }

  /// Each pose from a scan and its number there.
  static Result<Model> model_of(const std::vector<std::pair<std::filesystem::path, std::size_t>>& poses,
                                const ReconstructOptions& options) {
    Reconstruction reconstruction(*ScanFolder::open(figurine_)->load_calibration(), options);
    for (std::size_t pose = 0; pose < poses.size(); ++pose) {
      const auto scan = ScanFolder::open(poses[pose].first);
      if (!scan) return pass_on(scan);
      for (std::size_t view = 0; view < kViews; ++view) {
        const auto images = scan->load_images(poses[pose].second, view);
        if (!images) return pass_on(images);
        if (auto done = reconstruction.add_view(pose, *images, {}); !done) return pass_on(done);
      }
      if (auto done = reconstruction.finish_pose(pose, {}); !done) return pass_on(done);
    }
    return reconstruction.finish({}, {});
  }

  static inline std::filesystem::path figurine_, gauge_;
};

TEST_F(ManyPoses, MakeOneModelInWhichEachPoseHasItsPlace) {
  const auto model = reconstruct(*ScanFolder::open(figurine_), {.voxel_mm = 0.6}, {});
  ASSERT_TRUE(model) << model.error().message;
  const auto& report = *model->report;
  EXPECT_THAT(report["pose_graph"]["poses"].get<std::vector<int>>(), ElementsAre(0, 1, 2));
  EXPECT_TRUE(report["pose_graph"]["left_out"].empty());
  EXPECT_EQ(report["pose_graph"]["pairs"].size(), 3U);
  EXPECT_EQ(report["poses"].size(), 3U);
  EXPECT_TRUE(report["mesh"]["watertight"].get<bool>());
  EXPECT_GT(report["mesh"]["measured_share"].get<double>(), 0.9);
  EXPECT_GT(report["texture"]["seen_share"].get<double>(), 0.9);
  const auto folder = scratch("model");
  ASSERT_TRUE(write_model(*model, folder, 0));
  const auto claim = read_claim(folder);
  const auto truth = read_truth(figurine_);
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(claim && truth);
  const auto scores =
      evaluate(*claim, *truth, nullptr, {.samples = 20'000, .sigma_samples = 2'000, .carve_voxel_mm = 2.0}, {});
  ASSERT_TRUE(scores) << scores.error().message;
  ASSERT_TRUE(scores->pose2);
  ASSERT_EQ(scores->further_poses.size(), 1U);
  for (const auto& error : {*scores->pose2, scores->further_poses[0].error}) {
    EXPECT_LT(error.deg, 0.05);
    EXPECT_LT(error.mm, 0.05);
    EXPECT_LT(error.sigmas, 6.0);
  }
  EXPECT_LT(scores->measured.median, 0.05);
  EXPECT_LT(scores->measured.share_over_025, 0.01);
}

TEST_F(ManyPoses, OneOfAnotherObjectIsLeftOutAndNamed) {
  const auto model = model_of({{figurine_, 0}, {gauge_, 0}, {figurine_, 2}}, {.voxel_mm = 0.8, .texture = false});
  ASSERT_TRUE(model) << model.error().message;
  const auto& report = *model->report;
  EXPECT_THAT(report["pose_graph"]["poses"].get<std::vector<int>>(), ElementsAre(0, 2));
  ASSERT_EQ(report["pose_graph"]["left_out"].size(), 1U);
  EXPECT_EQ(report["pose_graph"]["left_out"][0]["pose"], 1);
  EXPECT_TRUE(report.contains("pose1_from_pose3"));
  EXPECT_FALSE(report.contains("pose1_from_pose2"));
  ASSERT_EQ(report["disagreements"].size(), 1U);
  EXPECT_EQ(report["disagreements"][0]["what"], "pose");
  EXPECT_THAT(report["disagreements"][0]["sentence"].get<std::string>(), HasSubstr("Pose 2 is not used"));
}

TEST_F(ManyPoses, MoreThanEightOrMoreThanTheClassTableCombinesAreRefused) {
  const auto images = ScanFolder::open(figurine_)->load_images(0, 0);
  ASSERT_TRUE(images);
  const auto refusal = [&](std::size_t pose, const char* fusion) {
    Reconstruction reconstruction(*ScanFolder::open(figurine_)->load_calibration(), {.fusion = fusion});
    return reconstruction.add_view(pose, *images, {});
  };
  const auto ninth = refusal(8, "evidence"), third = refusal(2, "paper");
  ASSERT_FALSE(ninth);
  EXPECT_EQ(ninth.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(ninth.error().message, HasSubstr("1 to 8 poses, not 9"));
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(third.error().message, HasSubstr("combines two poses"));
}

}  // namespace
}  // namespace scanrig
