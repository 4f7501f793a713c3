// Real range scans without their positions: the published ones are read for the judgement alone.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/units.h"
#include "pipeline/importers/import_meshes.h"
#include "pipeline/importers/mesh_view.h"
#include "pipeline/importers/stanford_files.h"
#include "pipeline/reconstruct/reconstruct.h"
#include "tests/own_folder.h"
#include "tests/shared_data.h"

namespace scanrig {
namespace {

/// Fewer than all, for time.
std::vector<PlacedScan> some_of(const std::vector<PlacedScan>& scans, std::size_t first, std::size_t count) {
  return {scans.begin() + static_cast<std::ptrdiff_t>(first),
          scans.begin() + static_cast<std::ptrdiff_t>(first + count)};
}

/// The mean of motions that differ little.
Transform mean_of(const std::vector<Transform>& motions, const Eigen::Vector3d& at) {
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  Eigen::Vector3d places = Eigen::Vector3d::Zero();
  for (const Transform& m : motions) {
    turns += m.linear();
    places += m * at / static_cast<double>(motions.size());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(turns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Transform mean = Transform::Identity();
  mean.linear() = svd.matrixU() * svd.matrixV().transpose();
  mean.translation() = places - mean.linear() * at;
  return mean;
}

class UnknownViewsOfDragon : public ::testing::Test {
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
  /// pose_from_world of each scan, by the folder's views and the published positions.
  [[nodiscard]] std::vector<Transform> found(const std::vector<PlacedScan>& scans, std::size_t first_view,
                                             const ScanFolder& scan) const {
    std::vector<Transform> motions;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const Transform camera_from_scan = read_view(scans[i].file, 0.0).value().camera_from_scan;
      motions.push_back(scan.manifest().poses[0].views[first_view + i].camera_from_pose.inverse() * camera_from_scan *
                        scans[i].world_from_scan.inverse());
    }
    return motions;
  }

  std::filesystem::path data_ = shared_data() / "stanford_dragon";
  std::filesystem::path folder_;
};

TEST_F(UnknownViewsOfDragon, UprightAndLyingScansBecomeOneModel) {
  const auto stand = some_of(read_stanford_conf(data_ / "stand/dragonStandRight.conf").value(), 0, 8);
  const auto side = some_of(read_stanford_conf(data_ / "side/dragonSideRight_ESTIMATED.conf").value(), 0, 4);
  std::vector<std::filesystem::path> files;
  for (const auto* set : {&stand, &side}) {
    for (const PlacedScan& scan : *set) files.push_back(scan.file);
  }
  const auto imported = import_meshes(files, folder_, {}, {});
  ASSERT_TRUE(imported) << imported.error().message;
  ASSERT_TRUE(imported->left_out.empty()) << imported->left_out.front().sentence;
  const auto scan = ScanFolder::open(folder_);
  ASSERT_TRUE(scan) << scan.error().message;

  const Eigen::Vector3d middle(0.0, 120.0, 0.0);  // of the dragon, in the world of the published positions
  const Transform of_stand = mean_of(found(stand, 0, *scan), middle);
  const Transform of_side = mean_of(found(side, stand.size(), *scan), middle);
  const Transform error = of_stand.inverse() * of_side;
  EXPECT_LE(to_degrees(rotation_angle(error.linear())), 0.5);
  EXPECT_LE((error * middle - middle).norm(), 0.8);

  const auto model = reconstruct(*scan, {.voxel_mm = 1.6}, {});
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_GT(model->mesh.mesh.faces.size(), 5000U);
}

TEST_F(UnknownViewsOfDragon, ScansFromOppositeSidesAreRefused) {
  const std::vector<std::filesystem::path> files{data_ / "stand/dragonStandRight_0.ply",
                                                 data_ / "stand/dragonStandRight_168.ply"};
  const auto imported = import_meshes(files, folder_, {}, {});
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().code, ErrorCode::no_overlap) << imported.error().message;
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

}  // namespace
}  // namespace scanrig
