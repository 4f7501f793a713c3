#include <opencv2/imgcodecs.hpp>

#include "tests/unit/pipeline/storage/scan_folder_fixture.h"

namespace scanrig {
namespace {

using BadScanFolderTest = ScanFolderTest;

std::string png(const cv::Mat& image) {
  std::vector<uchar> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST_F(BadScanFolderTest, AFolderWithoutAManifestIsNotFound) { expect_refused(ErrorCode::not_found, {"scan.json"}); }

TEST_F(BadScanFolderTest, AMissingImageIsNamed) {
  with_one_view();
  std::filesystem::remove(scan_ / "pose1/view00/right_plain.png");
  expect_refused(ErrorCode::not_found, {"pose1/view00/right_plain.png"});
}

TEST_F(BadScanFolderTest, ACompletePoseHasAllItsViews) {
  with_one_view();
  edit_manifest("\"complete\": false", "\"complete\": true");
  EXPECT_TRUE(ScanFolder::open(scan_));
  edit_manifest("\"index\": 0", "\"index\": 1");
  expect_refused(ErrorCode::invalid_input, {"scan.json", "poses[0].views", "view 0 is missing"});
}

TEST_F(BadScanFolderTest, AnUnknownKeyIsNamedWithItsPath) {
  with_one_view();
  edit_manifest("\"settling_ms\"", "\"speed\": 1, \"settling_ms\"");
  expect_refused(ErrorCode::invalid_input, {"scan.json", "poses[0].views[0].speed"});
}

TEST_F(BadScanFolderTest, AMissingKeyIsNamedWithItsPath) {
  with_one_view();
  edit_manifest("\"measured_deg\"", "\"measured\"");
  expect_refused(ErrorCode::invalid_input, {"scan.json", "poses[0].views[0].measured_deg"});
}

TEST_F(BadScanFolderTest, AFutureVersionIsUnsupported) {
  with_one_view();
  edit_manifest("\"version\": 6", "\"version\": 7");
  expect_refused(ErrorCode::unsupported, {"scan.json", "version"});
}

TEST_F(BadScanFolderTest, ExposuresOfThePatternAreDifferentNumbersWithFiles) {
  with_one_view();
  const std::string now = *read_file(scan_ / "scan.json");
  for (const char* factors : {"[0]", "[1]", "[100]", "[8, 8]"}) {
    write_text(scan_ / "scan.json",
               replaced(now, "\"files\"", fmt::format("\"pattern_factors\": {}, \"files\"", factors)));
    expect_refused(ErrorCode::invalid_input, {"scan.json", "poses[0].views[0].pattern_factors"});
  }
  write_text(scan_ / "scan.json", replaced(now, "\"files\"", "\"pattern_factors\": [8], \"files\""));
  expect_refused(ErrorCode::invalid_input, {"scan.json", "left_pattern_x8"});
}

TEST_F(BadScanFolderTest, AnUnknownStateIsRefused) {
  ScanFolder scan = with_one_view();
  EXPECT_EQ(scan.set_state("asleep").error().code, ErrorCode::invalid_input);
  edit_manifest("\"scanning\"", "\"asleep\"");
  expect_refused(ErrorCode::invalid_input, {"scan.json", "state", "asleep"});
}

TEST_F(BadScanFolderTest, HalfAManifestIsRefused) {
  with_one_view();
  const std::string text = read_file(scan_ / "scan.json").value();
  write_text(scan_ / "scan.json", text.substr(0, text.size() / 2));
  expect_refused(ErrorCode::invalid_input, {"scan.json", "JSON"});
}

TEST_F(BadScanFolderTest, APathOutOfTheFolderIsRefused) {
  with_one_view();
  edit_manifest("pose1/view00/left_plain.png", "../left_plain.png");
  expect_refused(ErrorCode::invalid_input, {"files.left_plain.path"});
}

TEST_F(BadScanFolderTest, APathThatEndsBeforeItsTextIsRefused) {
  with_one_view();
  edit_manifest("pose1/view00/left_plain.png", "pose1/view00/left_plain.png\\u0000");
  expect_refused(ErrorCode::invalid_input, {"files.left_plain.path"});
}

TEST_F(BadScanFolderTest, NestedListsForANumberAreRefusedHoweverDeep) {
  with_one_view();
  constexpr int kDeep = 200'000;
  edit_manifest("\"moving_ms\":", "\"moving_ms\":" + std::string(kDeep, '[') + std::string(kDeep, ']') + ", \"x\":");
  expect_refused(ErrorCode::invalid_input, {"scan.json", "poses[0].views[0].moving_ms", "not array"});
}

TEST_F(BadScanFolderTest, AChangedImageIsNoticedByItsHash) {
  with_one_view();
  write_text(scan_ / "pose1/view00/left_plain.png", png(raw_view(3).left_plain));
  expect_unloadable(ErrorCode::invalid_input, "pose1/view00/left_plain.png");
}

TEST_F(BadScanFolderTest, ATruncatedPngIsNamedEvenWhenItsHashIsRight) {
  with_one_view();
  const std::string whole = png(raw_view(0).left_plain);
  replace_image("pose1/view00/left_plain.png", whole.substr(0, whole.size() * 2 / 3));
  expect_unloadable(ErrorCode::invalid_input, "pose1/view00/left_plain.png");
}

TEST_F(BadScanFolderTest, AnImageOfTheWrongSizeIsNamed) {
  with_one_view();
  replace_image("pose1/view00/right_pattern.png", png(cv::Mat::zeros(24, 32, CV_8UC1)));
  expect_unloadable(ErrorCode::invalid_input, "pose1/view00/right_pattern.png");
}

TEST_F(BadScanFolderTest, AnImageOfSixteenBitsIsRefused) {
  with_one_view();
  replace_image("pose1/view00/right_pattern.png", png(cv::Mat::zeros(48, 64, CV_16UC1)));
  expect_unloadable(ErrorCode::invalid_input, "pose1/view00");
}

TEST_F(BadScanFolderTest, AMissingViewIsNotFound) {
  EXPECT_EQ(with_one_view().load_raw(0, 1).error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace scanrig
