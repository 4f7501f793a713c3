// `scanrig convert`: whole files under their names, or none.
#include <gtest/gtest.h>

#include "core/files.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/storage/scan_folder.h"
#include "tests/own_folder.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCalibration = R"({
  "format": "scanrig-calibration", "version": 1, "date": "2026-11-21T09:00:00Z", "table_radius_mm": 90.0, "report": {},
  "left": { "serial": "L", "width": 32, "height": 24, "fx": 100.0, "fy": 100.0, "cx": 15.5, "cy": 11.5,
    "distortion": [0, 0, 0, 0, 0],
    "camera_from_turntable": { "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [0,0,500] } },
  "right": { "serial": "R", "width": 32, "height": 24, "fx": 100.0, "fy": 100.0, "cx": 15.5, "cy": 11.5,
    "distortion": [0, 0, 0, 0, 0],
    "camera_from_turntable": { "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [-100,0,500] } }
})";

class Convert : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    ASSERT_TRUE(create_directories_synced(folder_));
    ASSERT_TRUE(write_file_atomically(folder_ / "calibration.json", kCalibration));
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] ConvertVerb verb(const std::string& what, const std::string& out) const {
    ConvertVerb verb;
    verb.what = what;
    verb.from = folder_;
    verb.out = folder_ / out;
    return verb;
  }
  /// A scan of one view with colour sensors.
  [[nodiscard]] fs::path scan() const {
    Manifest manifest;
    manifest.id = "test";
    manifest.created = "2026-11-25T09:00:00Z";
    auto made = ScanFolder::create(folder_ / "scan", manifest, folder_ / "calibration.json");
    EXPECT_TRUE(made) << made.error().message;
    const cv::Mat image(24, 32, CV_8UC1, cv::Scalar(90));
    ViewRecord record;
    record.taken = "2026-11-25T09:00:01Z";
    const auto added = made->add_view(0, record, {"BayerRG8", image, image, image, image});
    EXPECT_TRUE(added) << added.error().message;
    return folder_ / "scan";
  }

  const fs::path folder_ = own_folder("convert_");
};

TEST_F(Convert, WritesACalibrationOfAFolderOrAFile) {
  EXPECT_EQ(convert(verb("mrcal", "mrcal")), ExitCode::ok);
  EXPECT_TRUE(fs::exists(folder_ / "mrcal/left.cameramodel"));
  EXPECT_TRUE(fs::exists(folder_ / "mrcal/right.cameramodel"));
  ConvertVerb of_file = verb("opencv", "rig.yaml");
  of_file.from = folder_ / "calibration.json";
  EXPECT_EQ(convert(of_file), ExitCode::ok);
  EXPECT_TRUE(read_file(folder_ / "rig.yaml").value_or("").starts_with("%YAML:1.0\n---\n"));
}

TEST_F(Convert, OverwritesNothing) {
  ASSERT_TRUE(write_file_atomically(folder_ / "rig.yaml", std::string_view("mine")));
  EXPECT_EQ(convert(verb("opencv", "rig.yaml")), ExitCode::bad_input);
  EXPECT_EQ(read_file(folder_ / "rig.yaml").value_or(""), "mine");
}

TEST_F(Convert, WritesAScanAndOnRequestItsImagesInColour) {
  ConvertVerb of_scan = verb("colmap", "colmap");
  of_scan.from = scan();
  EXPECT_EQ(convert(of_scan), ExitCode::ok);
  EXPECT_NE(read_file(of_scan.out / "pose1/images.txt").value_or("").find(" 2 pose1/view00/right_plain.png\n"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(of_scan.out / "images"));
  of_scan.out = folder_ / "with_images";
  of_scan.images = true;
  EXPECT_EQ(convert(of_scan), ExitCode::ok);
  EXPECT_NE(read_file(of_scan.out / "pose1/images.txt").value_or("").find(" 1 pose1/view00_left.png\n"),
            std::string::npos);
  EXPECT_TRUE(fs::exists(of_scan.out / "images/pose1/view00_left.png"));
  EXPECT_TRUE(fs::exists(of_scan.out / "images/pose1/view00_right.png"));
}

TEST_F(Convert, OfWhatIsMissingLeavesNothing) {
  ConvertVerb missing = verb("mrcal", "mrcal");
  missing.from = folder_ / "elsewhere.json";
  EXPECT_EQ(convert(missing), ExitCode::bad_input);
  EXPECT_FALSE(fs::exists(missing.out));
  ConvertVerb damaged = verb("colmap", "colmap");
  damaged.from = scan();
  damaged.images = true;
  fs::resize_file(damaged.from / "pose1/view00/left_plain.png", 20);
  EXPECT_EQ(convert(damaged), ExitCode::bad_input);
  EXPECT_FALSE(fs::exists(damaged.out));
  EXPECT_FALSE(fs::exists(damaged.out.string() + ".new"));
}

}  // namespace
}  // namespace scanrig::ctl
