#include "pipeline/storage/scan_folder.h"

#include <cmath>
#include <limits>

#include "tests/unit/pipeline/storage/scan_folder_fixture.h"

namespace scanrig {
namespace {

TEST_F(ScanFolderTest, WhatIsWrittenIsReadBack) {
  {
    ScanFolder scan = create();
    for (int i : {0, 1}) ASSERT_TRUE(scan.add_view(0, record(i), raw_view(i)));
    ASSERT_TRUE(scan.complete_pose(0, "scanning"));
    ASSERT_TRUE(scan.add_view(1, record(0), raw_view(7)));
    ASSERT_TRUE(scan.set_state("waiting_for_flip"));
  }
  const auto scan = ScanFolder::open(scan_);
  ASSERT_TRUE(scan) << scan.error().message;
  const Manifest& manifest = scan->manifest();
  EXPECT_EQ(manifest.id, "20261121-093000-1");
  EXPECT_EQ(manifest.state, "waiting_for_flip");
  ASSERT_EQ(manifest.poses.size(), 2u);
  EXPECT_TRUE(manifest.poses[0].complete);
  EXPECT_FALSE(manifest.poses[1].complete);
  ASSERT_EQ(manifest.poses[0].views.size(), 2u);
  EXPECT_EQ(manifest.poses[0].views[1].measured_deg, 45.0031);
  EXPECT_EQ(manifest.poses[0].views[1].files.at("left_plain").path, "pose1/view01/left_plain.png");
  const auto raw = scan->load_raw(1, 0);
  ASSERT_TRUE(raw) << raw.error().message;
  EXPECT_TRUE(same(raw->left_pattern, raw_view(7).left_pattern));
  EXPECT_TRUE(same(raw->right_plain, raw_view(7).right_plain));
  const auto images = scan->load_images(0, 1);
  ASSERT_TRUE(images);
  EXPECT_EQ(images->left_plain.channels(), 3);
  EXPECT_NEAR(images->angle_rad, 0.78545, 1e-4);
  const auto calibration = scan->load_calibration();
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_EQ(calibration->right.projection.fy, 201.0);
  EXPECT_EQ(calibration->left.distortion[4], 0.05);
  EXPECT_EQ(calibration->sha256, manifest.calibration->sha256);
}

TEST_F(ScanFolderTest, OneImageIsLoadedWithoutTheOthers) {
  const ScanFolder scan = with_one_view();
  for (const char* other : {"left_pattern", "right_pattern", "right_plain"})
    std::filesystem::remove(scan_ / "pose1/view00" / (std::string(other) + ".png"));
  const auto image = scan.load_usable_image(0, 0, "left_plain");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_TRUE(same(*image, to_view_images(raw_view(0), {})->left_plain));
  EXPECT_EQ(scan.load_usable_image(0, 0, "right_plain").error().code, ErrorCode::not_found);
  EXPECT_EQ(scan.load_usable_image(0, 0, "upper_plain").error().code, ErrorCode::not_found);
  EXPECT_EQ(scan.load_usable_image(0, 1, "left_plain").error().code, ErrorCode::not_found);
}

TEST_F(ScanFolderTest, TheCalibrationIsReadOnce) {
  const ScanFolder scan = with_one_view();
  ASSERT_TRUE(scan.load_calibration());
  std::filesystem::remove(scan_ / scan.manifest().calibration->path);
  EXPECT_EQ(scan.load_calibration()->right.projection.fy, 201.0);
  EXPECT_TRUE(scan.load_images(0, 0));
}

TEST_F(ScanFolderTest, ADamagedCalibrationIsRefusedUntilItIsWhole) {
  const ScanFolder scan = with_one_view();
  const auto file = scan_ / scan.manifest().calibration->path;
  const std::string whole = read_file(file).value();
  write_text(file, whole + " ");
  EXPECT_EQ(scan.load_calibration().error().code, ErrorCode::invalid_input);
  write_text(file, whole);
  EXPECT_TRUE(scan.load_calibration());
}

TEST_F(ScanFolderTest, AMovementCheckIsKeptAsEvidence) {
  ScanFolder scan = with_one_view();
  ASSERT_TRUE(scan.add_movement_check(
      0, {1, 360.01, "2026-11-21T09:31:00Z", 1.25, 0.1, false, {{ErrorCode::timeout, "left camera: no frame"}}}));
  EXPECT_EQ(scan.add_movement_check(1, {}).error().code, ErrorCode::invalid_input) << "no such pose";
  const auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_EQ(again->manifest().poses[0].movement_checks.size(), 1u);
  const auto& movement_check = again->manifest().poses[0].movement_checks[0];
  EXPECT_EQ(movement_check.after_views, 1);
  EXPECT_EQ(movement_check.shift_px, 1.25);
  EXPECT_FALSE(movement_check.unmoved);
  ASSERT_EQ(movement_check.retake_reasons.size(), 1u);
  EXPECT_EQ(movement_check.retake_reasons[0].message, "left camera: no frame");
}

TEST_F(ScanFolderTest, ReasonsOfRetakesAreKept) {
  ScanFolder scan = create();
  auto view = record(0);
  view.retake_reasons = {{ErrorCode::timeout, "left camera: no frame"}, {ErrorCode::protocol, "right camera: torn"}};
  ASSERT_TRUE(scan.add_view(0, view, raw_view(0)));
  const auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  const auto& kept = again->manifest().poses[0].views[0].retake_reasons;
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].code, ErrorCode::timeout);
  EXPECT_EQ(kept[1].message, "right camera: torn");
  edit_manifest("\"timeout\"", "\"tired\"");
  const auto unknown = ScanFolder::open(scan_);
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("retake_reasons[0].code"), std::string::npos) << unknown.error().message;
}

TEST_F(ScanFolderTest, AnOlderFolderIsReadAndBecomesANewOneWithItsNextChange) {
  ScanFolder scan = with_one_view();
  const std::string now = *read_file(scan_ / "scan.json");
  const auto fifth = replaced(now, "\"version\": 6", "\"version\": 5");
  const auto fourth = replaced(fifth, "\"version\": 5", "\"version\": 4");
  const auto third =
      replaced(replaced(fourth, "\"version\": 4", "\"version\": 3"), "movement_checks", "closures");  // old name
  const auto second = replaced(replaced(third, "\"version\": 3", "\"version\": 2"), "  \"config_sha256\": [],\n", "");
  const auto first =
      replaced(replaced(second, "\"version\": 2", "\"version\": 1"), ",\n      \"closures\": []", "");  // old name
  for (const auto& old : {first, second, third, fourth, fifth}) {
    write_text(scan_ / "scan.json", old);
    auto again = ScanFolder::open(scan_);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_TRUE(again->manifest().config_sha256.empty());
    ASSERT_TRUE(again->set_state(again->manifest().state));
    EXPECT_EQ(*read_file(scan_ / "scan.json"), now);
  }
}

TEST_F(ScanFolderTest, RetakesAndMovementChecksOfAnOlderFolderAreRead) {
  ScanFolder scan = create();
  auto view = record(0);
  view.retake_reasons = {{ErrorCode::timeout, "left camera: no frame"}};
  ASSERT_TRUE(scan.add_view(0, view, raw_view(0)));
  ASSERT_TRUE(scan.add_movement_check(0, {.after_views = 1,
                                          .taken = "2026-11-21T09:31:10Z",
                                          .shift_px = 0.5,
                                          .unmoved = true,
                                          .retake_reasons = {{ErrorCode::protocol, "torn"}}}));
  edit_manifest("\"version\": 6", "\"version\": 3");
  edit_manifest("movement_checks", "closures");  // old name
  edit_manifest("retake_reasons", "spoilt");     // old name
  edit_manifest("retake_reasons", "spoilt");     // old name
  const auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  const auto& pose = again->manifest().poses[0];
  ASSERT_EQ(pose.views[0].retake_reasons.size(), 1u);
  ASSERT_EQ(pose.movement_checks.size(), 1u);
  EXPECT_EQ(pose.movement_checks[0].shift_px, 0.5);
  EXPECT_EQ(pose.movement_checks[0].retake_reasons[0].message, "torn");
}

TEST_F(ScanFolderTest, EachConfigurationOfItsViewsIsKeptOnce) {
  const std::string a(64, 'a'), b(64, 'b');
  {
    ScanFolder scan = create();
    scan.taken_under(a);
    EXPECT_TRUE(ScanFolder::open(scan_)->manifest().config_sha256.empty()) << "it has no views yet";
    for (int i : {0, 1}) ASSERT_TRUE(scan.add_view(0, record(i), raw_view(i)));
  }
  auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->manifest().config_sha256, std::vector{a});
  for (const auto& config : {b, a, std::string()}) {
    again->taken_under(config);
    ASSERT_TRUE(again->add_view(0, record(2), raw_view(2)));
  }
  EXPECT_EQ(ScanFolder::open(scan_)->manifest().config_sha256, (std::vector{a, b}));
  edit_manifest(b, "b");
  expect_refused(ErrorCode::invalid_input, {"scan.json", "config_sha256"});
}

// The example of docs/reference/scan-folder.md, shortened to one view.
TEST_F(ScanFolderTest, TheDocumentedManifestIsRead) {
  const std::string zeros(64, '0');
  std::string text = R"({
    "format": "scanrig-scan", "version": 6, "id": "20261121-093000-1", "created": "2026-11-21T09:30:00Z",
    "state": "scanning", "source": "stereo", "profile": "", "config_sha256": ["HASH"],
    "calibration": { "file": "calibration.json", "sha256": "HASH" },
    "poses": [
      { "name": "pose1", "complete": true,
        "views": [
          { "index": 0, "commanded_deg": 0.0, "measured_deg": 0.003, "moving_ms": 0, "settling_ms": 210,
            "taken": "2026-11-21T09:30:04Z", "pixel_format": "BayerRG8",
            "files": {
              "left_pattern":  { "path": "pose1/view00/left_pattern.png",  "sha256": "HASH" },
              "right_pattern": { "path": "pose1/view00/right_pattern.png", "sha256": "HASH" },
              "left_plain":    { "path": "pose1/view00/left_plain.png",    "sha256": "HASH" },
              "right_plain":   { "path": "pose1/view00/right_plain.png",   "sha256": "HASH" } } } ],
        "movement_checks": [ { "after_views": 1, "measured_deg": 0.002, "taken": "2026-11-21T09:31:10Z",
                        "shift_px": 0.11, "changed": 0.01, "unmoved": true } ] },
      { "name": "pose2", "complete": false, "views": [], "movement_checks": [] } ] })";
  for (auto at = text.find("HASH"); at != std::string::npos; at = text.find("HASH")) text.replace(at, 4, zeros);
  write_text(folder_ / "scan.json", text);
  const auto manifest = read_manifest(folder_ / "scan.json");
  ASSERT_TRUE(manifest) << manifest.error().message;
  EXPECT_EQ(manifest->calibration->path, "calibration.json");
  EXPECT_EQ(manifest->poses.at(0).views.at(0).settling_ms, 210.0);
  write_text(folder_ / "again.json", to_json(*manifest));
  EXPECT_EQ(to_json(*read_manifest(folder_ / "again.json")), to_json(*manifest));
}

TEST_F(ScanFolderTest, AnExistingFolderIsNotOverwritten) {
  create();
  const auto again = ScanFolder::create(scan_, {}, {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);
}

TEST_F(ScanFolderTest, AFolderThatCannotBeMadeIsAnInputOutputError) {
  write_text(folder_ / "file", "");
  const auto scan = ScanFolder::create(folder_ / "file" / "scan", {}, {});
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::io);
}

TEST_F(ScanFolderTest, ABadCalibrationMakesNoScan) {
  write_text(folder_ / "bad.json", "{}");
  EXPECT_FALSE(ScanFolder::create(scan_, {}, folder_ / "bad.json"));
  EXPECT_FALSE(std::filesystem::exists(scan_));
}

TEST_F(ScanFolderTest, ARetakenViewReplacesTheFirst) {
  ScanFolder scan = create();
  for (int i : {3, 1, 2}) ASSERT_TRUE(scan.add_view(0, record(i), raw_view(i)));
  for (int seed : {20, 30, 40}) {
    ASSERT_TRUE(scan.add_view(0, record(2), raw_view(seed)));
    const auto opened = ScanFolder::open(scan_);
    ASSERT_TRUE(opened) << opened.error().message;
    ASSERT_EQ(opened->manifest().poses[0].views.size(), 3u);
    EXPECT_EQ(opened->manifest().poses[0].views[1].index, 2);
    EXPECT_TRUE(same(opened->load_raw(0, 1)->left_plain, raw_view(seed).left_plain));
  }
  const std::filesystem::directory_iterator folders(scan_ / "pose1");
  EXPECT_EQ(std::distance(folders, {}), 3) << "the replaced views' folders are gone";
}

// The manifest is written last: at every moment before, the old manifest and every file it names are whole.
TEST_F(ScanFolderTest, ACrashBeforeTheManifestLeavesTheOldScan) {
  ScanFolder scan = with_one_view();
  const std::string before = read_file(scan_ / "scan.json").value();
  ASSERT_TRUE(scan.add_view(0, record(1), raw_view(1)));
  write_text(scan_ / "scan.json", before);
  write_text(scan_ / "scan.json.tmp4711", "{ half a mani");
  auto opened = ScanFolder::open(scan_);
  ASSERT_TRUE(opened) << opened.error().message;
  ASSERT_EQ(opened->manifest().poses[0].views.size(), 1u);
  EXPECT_TRUE(opened->load_raw(0, 0));
  EXPECT_TRUE(opened->add_view(0, record(1), raw_view(5))) << "the left-over folder does not interfere";
  EXPECT_TRUE(same(ScanFolder::open(scan_)->load_raw(0, 1)->left_pattern, raw_view(5).left_pattern));
}

// With the manifest's rename made impossible, as on a full disk, the view to be replaced must still exist.
TEST_F(ScanFolderTest, AFailedReplacementLeavesTheFirstView) {
  ScanFolder scan = with_one_view();
  std::filesystem::rename(scan_ / "scan.json", scan_ / "kept.json");
  std::filesystem::create_directories(scan_ / "scan.json" / "in the way");
  const auto added = scan.add_view(0, record(0), raw_view(9));
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().code, ErrorCode::io);
  EXPECT_TRUE(same(scan.load_raw(0, 0)->left_pattern, raw_view(0).left_pattern));
  std::filesystem::remove_all(scan_ / "scan.json");
  std::filesystem::rename(scan_ / "kept.json", scan_ / "scan.json");
  EXPECT_TRUE(same(ScanFolder::open(scan_)->load_raw(0, 0)->left_pattern, raw_view(0).left_pattern));
}

TEST_F(ScanFolderTest, InconsistentImagesAreNotStored) {
  ScanFolder scan = create();
  RawView raw = raw_view(0);
  raw.left_plain = cv::Mat::zeros(10, 10, CV_8UC1);
  EXPECT_EQ(scan.add_view(0, record(0), raw).error().code, ErrorCode::invalid_input);
  raw = raw_view(0);
  raw.pixel_format = "BGR8";
  EXPECT_EQ(scan.add_view(0, record(0), raw).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(scan.add_view(1, record(0), raw_view(0)).error().code, ErrorCode::invalid_input) << "pose 2 before pose 1";
  EXPECT_TRUE(scan.manifest().poses.empty());
}

TEST_F(ScanFolderTest, MoreExposuresOfThePatternAreKeptAndReadBack) {
  ScanFolder scan = create();
  RawView raw = raw_view(0);
  raw.more_patterns = {{8.0, raw_view(20).left_pattern, raw_view(20).right_pattern},
                       {0.25, raw_view(30).left_pattern, raw_view(30).right_pattern}};
  ASSERT_TRUE(scan.add_view(0, record(0), raw));
  ASSERT_TRUE(scan.add_view(0, record(1), raw_view(1)));
  const auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  const ViewRecord& view = again->manifest().poses[0].views[0];
  EXPECT_EQ(view.pattern_factors, (std::vector<double>{8.0, 0.25}));
  EXPECT_EQ(view.files.at("right_pattern_x0.25").path, "pose1/view00/right_pattern_x0.25.png");
  const auto loaded = again->load_raw(0, 0);
  ASSERT_TRUE(loaded) << loaded.error().message;
  ASSERT_EQ(loaded->more_patterns.size(), 2u);
  EXPECT_TRUE(same(loaded->more_patterns[0].left, raw_view(20).left_pattern));
  EXPECT_TRUE(same(loaded->more_patterns[1].right, raw_view(30).right_pattern));
  EXPECT_EQ(again->load_images(0, 0)->left_pattern.type(), CV_16UC3);
  EXPECT_EQ(again->load_images(0, 0)->left_plain.type(), CV_8UC3);
  EXPECT_EQ(again->load_images(0, 1)->left_pattern.type(), CV_8UC3);

  ASSERT_TRUE(scan.add_view(0, record(0), raw_view(2))) << "taken again with one exposure";
  EXPECT_FALSE(std::filesystem::exists(scan_ / "pose1/view00/left_pattern_x8.png"));
  EXPECT_TRUE(ScanFolder::open(scan_)->load_raw(0, 0)->more_patterns.empty());
}

TEST_F(ScanFolderTest, ExposuresThatDifferInSizeAreNotStored) {
  ScanFolder scan = create();
  RawView raw = raw_view(0);
  raw.more_patterns = {{8.0, raw.left_pattern, cv::Mat::zeros(10, 10, CV_8UC1)}};
  const auto added = scan.add_view(0, record(0), raw);
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().code, ErrorCode::invalid_input);
  EXPECT_NE(added.error().message.find("right_pattern_x8"), std::string::npos) << added.error().message;
}

TEST_F(ScanFolderTest, ACalibrationHasTwoPlainImagesAViewAndNeedsNoCalibration) {
  auto scan = ScanFolder::create(scan_, {.id = "20261121-093000-1", .source = "calibration"}, {});
  ASSERT_TRUE(scan) << scan.error().message;
  auto plain = raw_view(3);
  plain.left_pattern = plain.right_pattern = cv::Mat();
  ASSERT_TRUE(scan->add_view(0, record(0), plain));
  const auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->manifest().poses[0].views[0].files.size(), 2u);
  const auto raw = again->load_raw(0, 0);
  ASSERT_TRUE(raw) << raw.error().message;
  EXPECT_TRUE(same(raw->left_plain, plain.left_plain));
  EXPECT_TRUE(raw->left_pattern.empty());
  EXPECT_TRUE(again->load_usable_image(0, 0, "right_plain"));
  plain.right_plain = cv::Mat();
  EXPECT_EQ(scan->add_view(0, record(1), plain).error().code, ErrorCode::invalid_input);
}

TEST_F(ScanFolderTest, DroppedViewsAreTakenAnew) {
  ScanFolder scan = with_one_view();
  ASSERT_TRUE(scan.add_movement_check(0, {.after_views = 1, .taken = "2026-11-21T09:31:10Z", .unmoved = false}));
  ASSERT_TRUE(scan.drop_views(0, "waiting_for_flip"));
  auto again = ScanFolder::open(scan_);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->manifest().state, "waiting_for_flip");
  EXPECT_TRUE(again->manifest().poses[0].views.empty());
  EXPECT_TRUE(again->manifest().poses[0].movement_checks.empty());
  ASSERT_TRUE(again->add_view(0, record(0), raw_view(5)));
  EXPECT_TRUE(same(again->load_raw(0, 0)->left_plain, raw_view(5).left_plain));
  EXPECT_EQ(again->drop_views(1, "scanning").error().code, ErrorCode::invalid_input);
}

TEST_F(ScanFolderTest, ARangeViewKeepsItsDepthsAndItsGaps) {
  Manifest manifest;
  manifest.source = "range";
  auto scan = ScanFolder::create(scan_, manifest, {});
  ASSERT_TRUE(scan) << scan.error().message;
  // A plane rising 0.5 mm a mm in x, with a hole and a step of 20 mm.
  cv::Mat1f depth(40, 60);
  for (int r = 0; r < depth.rows; ++r) {
    for (int c = 0; c < depth.cols; ++c)
      depth(r, c) = 300.0f + 0.25f * static_cast<float>(c) + (c >= 30 ? 20.0f : 0.0f);
  }
  depth(20, 10) = std::numeric_limits<float>::quiet_NaN();
  ViewRecord view = record(0);
  view.grid = Projection{Projection::Kind::orthographic, 60, 40, 2.0, 2.0, 29.5, 19.5};
  view.camera_from_pose.translation() = Eigen::Vector3d(1, 2, 3);
  ASSERT_TRUE(scan->add_range_view(0, view, depth));

  const auto opened = ScanFolder::open(scan_);
  ASSERT_TRUE(opened) << opened.error().message;
  const auto range = opened->load_range(0, 0);
  ASSERT_TRUE(range) << range.error().message;
  EXPECT_EQ(range->projection.width, 60);
  EXPECT_EQ(range->camera_from_pose.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(range->depth(5, 7), depth(5, 7));
  EXPECT_TRUE(std::isnan(range->depth(20, 10)));
  // (0.5, 0, -1) / |.| at the camera's side; also beside the step, where only one surface may be used.
  for (const int col : {7, 29, 30}) {
    EXPECT_NEAR(range->normal(5, col)[0], 0.44721, 1e-4) << col;
    EXPECT_NEAR(range->normal(5, col)[2], -0.89443, 1e-4) << col;
    EXPECT_GT(range->sigma(5, col), 0.0f);
  }
  EXPECT_EQ(opened->load_raw(0, 0).error().code, ErrorCode::invalid_input) << "no images in a range scan";
}

}  // namespace
}  // namespace scanrig
