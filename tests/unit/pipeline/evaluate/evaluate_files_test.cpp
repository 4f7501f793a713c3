#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/files.h"
#include "core/statistics.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/evaluate/texture_figures.h"
#include "pipeline/model_io/model_files.h"
#include "pipeline/texture/render.h"
#include "tests/own_folder.h"
#include "tests/unit/pipeline/evaluate/ball_truth.h"

namespace scanrig {
namespace {

using namespace ball_truth;

class EvaluateFilesTest : public testing::Test {
 protected:
  std::filesystem::path folder_ = own_folder();
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write_truth(const std::string& projector_key = "projector_from_turntable") {
    const std::string identity = R"({ "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [0, 0, 640] })";
    const std::string lens = R"("width": 1280, "height": 960, "fx": 4266, "fy": 4266, "cx": 640, "cy": 480)";
    const std::string camera =
        R"({ "serial": "S", )" + lens + R"(, "distortion": [0,0,0,0,0], "camera_from_turntable": )" + identity + "}";
    const std::string text = R"({ "format": "scanrig-truth", "version": 1, "profile_sha256": "", "object": "ball",
        "seed": 1, "mesh": "truth.ply", "left": )" +
                             camera + R"(, "right": )" + camera + R"(, "projector": { )" + lens + ", \"" +
                             projector_key + "\": " + identity + R"( }, "table_radius_mm": 90,
        "poses": [ { "table_from_truth": )" +
                             identity + R"(, "angles_deg": [0, 45] } ], "pose1_from_pose2": )" + identity + "}";
    ASSERT_TRUE(write_file_atomically(folder_ / "truth.json", text));
    ASSERT_TRUE(write_file_atomically(folder_ / "truth.ply", encode_ply(ball())));
  }
};

TEST_F(EvaluateFilesTest, TheTruthIsRead) {
  write_truth();
  const auto truth = read_truth(folder_);
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_EQ(truth->mesh.faces.size(), ball().faces.size());
  EXPECT_EQ(truth->poses.at(0).angles_deg, (std::vector<double>{0.0, 45.0}));
  EXPECT_EQ(truth->pose1_from_pose2->translation().z(), 640.0);
  EXPECT_EQ(truth->table_radius_mm, 90.0);
}

TEST_F(EvaluateFilesTest, ABadTruthIsNamed) {
  EXPECT_EQ(read_truth(folder_).error().code, ErrorCode::not_found);
  write_truth("projector");
  const auto truth = read_truth(folder_);
  ASSERT_FALSE(truth);
  EXPECT_EQ(truth.error().code, ErrorCode::invalid_input);
  EXPECT_NE(truth.error().message.find("projector.projector_from_turntable"), std::string::npos)
      << truth.error().message;
}

TEST_F(EvaluateFilesTest, AModelsClaimsAreReadBack) {
  TexturedMesh model{ball(kRadius, kCentre, 10), {}, cv::Mat3b(16, 16, cv::Vec3b(10, 200, 30))};
  model.mesh.views[3] = 0;
  model.mesh.sigma.assign(model.mesh.vertices.size(), 0.02F);
  for (std::size_t f = 0; f < model.mesh.faces.size(); ++f) {
    const float u = static_cast<float>(f) / 1000.0F;
    model.corner_uv.push_back({Eigen::Vector2f(u, 0.25F), Eigen::Vector2f(u, 0.5F), Eigen::Vector2f(0.75F, u)});
  }
  const std::string report = R"({ "version": "0.1.0",
      "pose1_from_pose2": { "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [1, 2, 3] } })";
  ASSERT_TRUE(write_model_files(model, report, folder_ / "model"));
  const auto claim = read_claim(folder_ / "model");
  ASSERT_TRUE(claim) << claim.error().message;
  EXPECT_EQ(claim->model.mesh.views[3], 0);
  EXPECT_EQ(claim->model.mesh.sigma[5], 0.02F);
  ASSERT_EQ(claim->model.corner_uv.size(), model.corner_uv.size());
  EXPECT_LT((claim->model.corner_uv[7][2] - model.corner_uv[7][2]).norm(), 1e-6F);
  EXPECT_EQ(claim->model.atlas(5, 5), cv::Vec3b(10, 200, 30));
  EXPECT_EQ(claim->pose1_from_pose2->translation(), Eigen::Vector3d(1, 2, 3));

  const std::string obj = read_file(folder_ / "model" / "model.obj").value();
  const auto uv = obj.find("vt ");
  ASSERT_NE(uv, std::string::npos);
  ASSERT_TRUE(write_file_atomically(folder_ / "model" / "model.obj",
                                    obj.substr(0, uv) + "vt nan 0" + obj.substr(obj.find('\n', uv))));
  const auto nowhere = read_claim(folder_ / "model");
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().message.find("vt nan 0"), std::string::npos) << nowhere.error().message;

  ASSERT_TRUE(write_file_atomically(folder_ / "model" / "model.obj", "vt 0 0\nf 1/1 2/1 4/1\n"));
  EXPECT_EQ(read_claim(folder_ / "model").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(read_claim(folder_ / "absent").error().code, ErrorCode::not_found);
}

TEST_F(EvaluateFilesTest, PlacesOfManyPosesAreReadInTheFrameOfTheFirstThatWasKept) {
  const TexturedMesh model{ball(kRadius, kCentre, 10), {}, {}};
  const std::string place = R"({ "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [1, 2, )";
  std::string zeros = "0";
  for (int i = 1; i < 36; ++i) zeros += ", 0";
  const std::string known = R"("uncertainty": { "centre_mm": [4, 5, 6], "covariance": [)" + zeros + "] } }";
  const auto report_of = [&](int frame) {
    const std::string first = std::to_string(frame + 1);
    return R"({ "pose_graph": { "frame_of_pose": )" + std::to_string(frame) + R"( }, "pose)" + first +
           R"(_from_pose3": )" + place + R"(3] }, "pose)" + first + (frame == 0 ? "_from_pose2" : "_from_pose4") +
           R"(": )" + place + R"(7] }, "pose_refinement": { "poses": [ { "pose": )" + (frame == 0 ? "1" : "3") + ", " +
           known + R"(, { "pose": 2, )" + known + "] } }";
  };
  ASSERT_TRUE(write_model_files(model, report_of(0), folder_ / "model"));
  const auto whole = read_claim(folder_ / "model");
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->pose1_from_pose2->translation(), Eigen::Vector3d(1, 2, 7));
  EXPECT_TRUE(whole->pose_uncertainty);
  ASSERT_EQ(whole->further_poses.size(), 1U);
  EXPECT_EQ(whole->further_poses[0].pose, 2U);
  EXPECT_EQ(whole->further_poses[0].frame_from_pose.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(whole->further_poses[0].uncertainty->centre, Eigen::Vector3d(4, 5, 6));
  ASSERT_TRUE(write_model_files(model, report_of(1), folder_ / "model"));
  const auto second = read_claim(folder_ / "model");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->frame_of_pose, 1U);
  EXPECT_FALSE(second->pose1_from_pose2);
  EXPECT_EQ(second->further_poses.size(), 2U);
}

/// Blobs of grey without period.
cv::Mat1b speckle() {
  cv::Mat1f noise(300, 400);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> grey(0.0F, 255.0F);
  for (float& value : noise) value = grey(random);
  cv::GaussianBlur(noise, noise, {0, 0}, 2.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  cv::Mat1b image;
  noise.convertTo(image, CV_8U);
  return image;
}

/// The ball painted with speckle, by longitude and latitude.
TexturedMesh painted_ball() {
  TexturedMesh model{ball(), {}, {}};
  cv::cvtColor(speckle(), model.atlas, cv::COLOR_GRAY2BGR);
  for (const Mesh::Face& face : model.mesh.faces) {
    auto& uv = model.corner_uv.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = (model.mesh.vertices[face[k]].cast<double>() - kCentre).normalized();
      uv[k] = {static_cast<float>(0.5 + std::atan2(d.x(), d.z()) / (2.0 * std::numbers::pi)),
               static_cast<float>(std::acos(std::clamp(d.y(), -1.0, 1.0)) / std::numbers::pi)};
    }
  }
  return model;
}

TEST_F(EvaluateFilesTest, ATextureThatHasSlippedIsNoticed) {
  const Truth truth = rig_and_ball({20.0});
  TexturedMesh model = painted_ball();
  RenderOptions sharp;
  sharp.supersample = 3;
  const auto photo = MeshRenderer::create(model)->render(truth.left, rot_y(to_radians(20.0)), sharp);
  ASSERT_TRUE(photo) << photo.error().message;
  auto scan = ScanFolder::create(folder_ / "scan", {}, {});
  ASSERT_TRUE(scan);
  cv::Mat darker;
  photo->image.convertTo(darker, CV_8U, 0.6);
  ASSERT_TRUE(scan->add_view(0, {}, {"BGR8", darker, darker, darker, darker}));

  const auto right = texture_figures(model, truth, *scan, {}, {});
  ASSERT_TRUE(right) << right.error().message;
  EXPECT_GT(right->patches, 20u);
  EXPECT_LT(right->median_px, 0.1);
  // Slipped by 0.4 degrees about the axis: 0.17 mm or 1.2 px where the ball faces the camera, less towards its rim.
  for (auto& v : model.mesh.vertices) v = (rot_y(to_radians(0.4)) * v.cast<double>()).cast<float>();
  const auto slipped = texture_figures(model, truth, *scan, {}, {});
  ASSERT_TRUE(slipped);
  EXPECT_NEAR(slipped->median_px, 1.0, 0.2);
}

TEST(PatchOffsets, AShiftIsFoundInAnotherLight) {
  const cv::Mat1b drawn = speckle();
  cv::Mat photo;
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, 1.5, 0, 1, -0.8);
  cv::warpAffine(drawn, photo, shift, drawn.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  photo.convertTo(photo, CV_8U, 0.5, 20.0);
  cv::Mat1b mask(drawn.size(), uchar{0});
  mask(cv::Rect(50, 50, 300, 200)) = 255;
  const auto offsets = patch_offsets(drawn, photo, mask);
  EXPECT_GT(offsets.size(), 50u);
  EXPECT_NEAR(quantile(offsets, 0.5), 1.7, 0.05);
  EXPECT_LT(quantile(patch_offsets(drawn, drawn, mask), 0.95), 0.03);
}

TEST(PatchOffsets, PatchesWithoutStructureGiveNoOffset) {
  const cv::Mat1b flat(300, 400, uchar{100});
  const cv::Mat1b all(300, 400, uchar{255});
  EXPECT_TRUE(patch_offsets(flat, speckle(), all).empty());
  EXPECT_TRUE(patch_offsets(speckle(), speckle(), cv::Mat1b(300, 400, uchar{0})).empty());
}

}  // namespace
}  // namespace scanrig
