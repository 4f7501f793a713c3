// A rendered series of a rig drawn at random becomes a calibration; only the test knows the truth.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/hash.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/calibrate/calibration_json.h"
#include "pipeline/storage/calibration_file.h"
#include "sim/apps/shoot_board.h"
#include "tests/calibration_error.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

class CalibrateImages : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove_all(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void shoot(const sim::SeriesOptions& wanted) {
    const auto shot = sim::shoot_board(wanted, folder_);
    ASSERT_TRUE(shot) << shot.error().message;
    auto series = sim::CalibrationSeries::create(wanted);
    ASSERT_TRUE(series) << series.error().message;
    truth_ = (*series)->rig().geometry;
  }
  /// Half the resolution; three of the plan's placements beside the flat one, with few angles.
  static sim::SeriesOptions series() {
    sim::SeriesOptions options;
    options.rig = sim::RigVariation{.seed = 5};
    options.image_scale = 0.5;
    options.placements = {1, 2, 3, 4, 6, 7};
    options.angles = 4;
    return options;
  }
  Result<FolderCalibration> calibrate(const CalibrateOptions& options = {}) {
    const auto images = read_calibration_images(folder_);
    if (!images) return pass_on(images);
    return calibrate_images(*images, options);
  }

  const std::filesystem::path folder_ = own_folder("calibrate_");
  sim::RigGeometry truth_;
};

TEST_F(CalibrateImages, OfADrawnRigMeasuresItsWorkingVolumeAndIsReadBack) {
  shoot(series());
  CalibrateOptions options;
  options.rim_dots = RimDots{40, 84.5, 2.4};
  const auto outcome = calibrate(options);
  ASSERT_TRUE(outcome) << outcome.error().message;
  const auto& judged = outcome->judged;
  EXPECT_LT(judged.judgement.graded_um, 15.0);
  EXPECT_LT(calibration_error(judged.solved.calibration, truth_).rms_um, 15.0);
  EXPECT_GT(judged.solved.table.dots.size(), 20u);

  const auto text = calibration_json(*outcome, {.date = "2026-11-25T03:00:00Z"});
  ASSERT_TRUE(text) << text.error().message;
  const auto again = parse_calibration(*text, "calibration.json");
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_TRUE(again->quality);
  EXPECT_EQ(again->quality->volume_um, judged.solved.sigma->volume);
  EXPECT_EQ(again->quality->cameras.rows(), 30);
  EXPECT_EQ(again->quality->rim_dots.size(), judged.solved.table.dots.size());
  const Eigen::Vector3d p(10, 40, -20);
  EXPECT_EQ(again->left.project(p), judged.solved.calibration.left.project(p));

  auto damaged = nlohmann::json::parse(*text);
  damaged["covariance"]["cameras"][1] = 1e9;  // larger than the variances of its row and column
  const auto refused = parse_calibration(damaged.dump(), "calibration.json");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("covariance.cameras: must be a covariance"));
}

TEST_F(CalibrateImages, OfSwappedCamerasIsRefusedWithWhatToDo) {
  auto wanted = series();
  wanted.rig->swapped = 1.0;
  wanted.placements = {1, 2, 3, 7};
  shoot(wanted);
  const auto outcome = calibrate();
  ASSERT_TRUE(outcome) << outcome.error().message;
  const auto text = calibration_json(*outcome, {});
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().code, ErrorCode::below_limits);
  EXPECT_THAT(text.error().message, HasSubstr("Left and right cameras swapped: exchange the serials."));
}

TEST_F(CalibrateImages, ByTheCommandLeaveAReportAlsoWhenRefused) {
  auto wanted = series();
  wanted.rig->swapped = 1.0;
  wanted.placements = {1, 2, 3, 7};
  wanted.angles = 3;
  shoot(wanted);
  const auto out = folder_ / "calibration.json", report = folder_ / "calibration.html";
  ASSERT_TRUE(write_file_atomically(out, std::string_view("the one before")));
  ASSERT_TRUE(write_file_atomically(report, std::string_view("its report")));
  ctl::CalibrateFolderVerb verb;
  verb.images = folder_;
  verb.out = out;
  EXPECT_EQ(ctl::calibrate_folder(verb), ExitCode::below_limits);
  EXPECT_EQ(read_file(out).value_or(""), "the one before");
  const std::string page = read_file(report).value_or("");
  EXPECT_THAT(page, HasSubstr("<li>Left and right cameras swapped: exchange the serials.</li>"));
  const std::string hash = sha256(std::string_view("the one before")).substr(0, 8);
  const auto kept = folder_ / ("calibration." + hash + ".html");
  EXPECT_EQ(read_file(kept).value_or(""), "its report");

  // Again, under another name; then without one.
  std::filesystem::remove(report);
  verb.report = folder_ / "why.html";
  EXPECT_EQ(ctl::calibrate_folder(verb), ExitCode::below_limits);
  EXPECT_TRUE(std::filesystem::exists(verb.report));
  verb.report.clear();
  verb.with_report = false;
  EXPECT_EQ(ctl::calibrate_folder(verb), ExitCode::below_limits);
  EXPECT_FALSE(std::filesystem::exists(report));
  EXPECT_EQ(read_file(kept).value_or(""), "its report");
}

TEST_F(CalibrateImages, OfAnotherBoardSaysSo) {
  auto wanted = series();
  wanted.placements = {3};
  wanted.angles = 1;
  shoot(wanted);
  Board other;
  other.columns = 8;
  other.rows = 7;
  CalibrateOptions options;
  options.board = other;
  const auto outcome = calibrate(options);
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message, HasSubstr("no image shows the board"));
}

TEST_F(CalibrateImages, OfAnImageThatIsGoneLeavesItOutByName) {
  auto wanted = series();
  wanted.placements = {1, 2, 3, 7};
  wanted.angles = 3;
  shoot(wanted);
  const auto images = read_calibration_images(folder_);
  ASSERT_TRUE(images) << images.error().message;
  std::filesystem::remove(images->pairs[1].files[0]);
  const auto boards = find_boards(*images, images->pixel_format, Board{});
  ASSERT_TRUE(boards) << boards.error().message;
  EXPECT_TRUE(boards->pairs[1].left.corners.empty());
  const auto remark = std::ranges::find_if(boards->remarks, [](const ImageRemark& r) { return r.is_left_out; });
  ASSERT_NE(remark, boards->remarks.end());
  EXPECT_EQ(remark->pair, images->pairs[1].name);
  // What is used all the same has a remark, not an instruction.
  for (const ImageRemark& other : boards->remarks) {
    if (other.is_left_out) continue;
    EXPECT_THAT(other.message, testing::Not(HasSubstr(". "))) << other.pair;
  }
}

}  // namespace
}  // namespace scanrig
