// Real range scans, imported and reconstructed like any scan; coarse voxels, since the full bench does it in full.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/strict_json.h"
#include "pipeline/importers/import_stanford.h"
#include "pipeline/reconstruct/reconstruct.h"
#include "tests/bench/real_data/dragon_measure.h"
#include "tests/own_folder.h"
#include "tests/shared_data.h"

namespace scanrig {
namespace {

Transform pose2_of(const Model& model) {
  std::optional<Error> fault;
  return JsonObject(model.report.get(), "", &fault).transform("pose1_from_pose2");
}

class Dragon : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(data_)) GTEST_SKIP() << data_.string() << ": the scans are missing";
    folder_ = own_folder();
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
  }

  Result<bench::DragonMeasure> measure(bool both_poses) const {
    std::optional<std::filesystem::path> side;
    if (both_poses) side = data_ / "side/dragonSideRight_ESTIMATED.conf";
    if (auto done = import_stanford(data_ / "stand/dragonStandRight.conf", side, folder_); !done) return pass_on(done);
    const auto scan = ScanFolder::open(folder_);
    if (!scan) return pass_on(scan);
    const auto model = reconstruct(*scan, {.voxel_mm = 0.8}, {});
    if (!model) return pass_on(model);
    std::optional<Transform> pose2;
    if (both_poses) pose2 = pose2_of(*model);
    return bench::measure_dragon(data_, *scan, model->mesh.mesh, pose2);
  }

  std::filesystem::path data_ = shared_data() / "stanford_dragon";
  std::filesystem::path folder_;
};

TEST_F(Dragon, LyingScansAreAlignedWithTheUprightOnesWithoutHints) {
  const auto found = measure(true);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_TRUE(found->pose2);
  EXPECT_LE(found->pose2->rotation_deg, 1.0);
  EXPECT_LE(found->pose2->translation_mm, 1.5);
  EXPECT_GE(found->measured_share, 0.6);
}

TEST_F(Dragon, UprightScansMatchThePublishedMergedMesh) {
  const auto found = measure(false);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LE(found->median_mm, 0.4);
  EXPECT_GE(found->measured_share, 0.5);
}

}  // namespace
}  // namespace scanrig
