#include "pipeline/storage/calibration_images.h"

#include <gmock/gmock.h>

#include "core/files.h"
#include "core/hash.h"
#include "core/image_codec.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using namespace scan_samples;
using testing::HasSubstr;

constexpr const char* kPair = R"({ "placement": 4, "sets": ["B"], "table_deg": -56.5,
    "left": { "path": "a_left.png" }, "right": { "path": "a_right.png" } })";

std::string list(const std::string& pairs, const std::string& more = "") {
  return R"({ "format": "scanrig-calibration-images", "version": 1, "pixel_format": "BayerRG8", "exposure_us": 12000,
    "left": { "serial": "L", "focal_px": 4267 }, "right": { "serial": "R", "focal_px": 4260.5 }, )" +
         more + "\"pairs\": [" + pairs + "] }";
}

class CalibrationImagesTest : public FolderTest {
 protected:
  Result<CalibrationImages> read(const std::string& text) {
    write_text(folder_ / "calibration_images.json", text);
    return read_calibration_images(folder_);
  }
  std::string why_not(const std::string& text) {
    const auto images = read(text);
    return images ? "it was read" : images.error().message;
  }
  std::string write_image(const std::string& name) {
    const auto png = encode_png(cv::Mat(48, 64, CV_8UC1, cv::Scalar(7)));
    write_text(folder_ / name, std::string(as_text(*png)));
    return sha256(as_text(*png));
  }
};

TEST_F(CalibrationImagesTest, AListGivesPlacementsSetsAndAngles) {
  const auto images = read(list(std::string(kPair) + "," + kPair));
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_TRUE(images->is_on_table());
  EXPECT_EQ(images->pixel_format, "BayerRG8");
  EXPECT_EQ(images->serials[1], "R");
  EXPECT_EQ(images->focal_px[1], 4260.5);
  ASSERT_EQ(images->pairs.size(), 2u);
  const auto& pair = images->pairs[1];
  EXPECT_EQ(pair.name, "placement 4 image 2");
  EXPECT_FALSE(pair.in_a);
  EXPECT_TRUE(pair.in_b);
  EXPECT_EQ(pair.table_deg, -56.5);
  EXPECT_EQ(pair.files[0], folder_ / "a_left.png");
}

TEST_F(CalibrationImagesTest, ABoardHasItsMeasuredLengths) {
  const auto images = read(list(kPair, R"("board": { "columns": 12, "rows": 9, "square_mm": 10, "thickness_mm": 3,
      "markers": { "size_mm": 6, "dictionary": "4x4_100" },
      "lengths": [{ "from": 0, "to": 10, "mm": 100.021, "sigma_mm": 0.005 }] },)"));
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_EQ(images->board->columns, 12);
  EXPECT_EQ(images->board->markers->size_mm, 6.0);
  ASSERT_EQ(images->lengths.size(), 1u);
  EXPECT_EQ(images->lengths[0].mm, 100.021);
}

TEST_F(CalibrationImagesTest, FaultsOfAListAreNamedByKey) {
  const auto with = [](const std::string& what, const std::string& instead) {
    return list(replaced(kPair, what, instead));
  };
  EXPECT_THAT(why_not(with("\"B\"", "\"C\"")), HasSubstr("pairs[0].sets: must be \"A\", \"B\" or both"));
  EXPECT_THAT(why_not(with("[\"B\"]", "[]")), HasSubstr("pairs[0].sets: must not be empty"));
  EXPECT_THAT(why_not(with("a_left.png", "../a_left.png")), HasSubstr("pairs[0].left.path"));
  EXPECT_THAT(why_not(with("-56.5", "null")), HasSubstr("pairs[0].table_deg"));
  EXPECT_THAT(why_not(list("")), HasSubstr("pairs: must not be empty"));
  EXPECT_THAT(why_not(list(std::string(kPair) + "," + replaced(kPair, "\"table_deg\": -56.5,", ""))),
              HasSubstr("pairs: must all have a table_deg, or none"));
  EXPECT_EQ(read(replaced(list(kPair), "\"version\": 1", "\"version\": 2")).error().code, ErrorCode::unsupported);
}

TEST_F(CalibrationImagesTest, WithoutAListNamesMakeThePairs) {
  for (const char* name : {"b_left.png", "b_right.png", "a_left.jpg", "a_right.jpg", "notes.txt", "_left.png"}) {
    write_text(folder_ / name, "");
  }
  const auto images = read_calibration_images(folder_);
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_FALSE(images->is_on_table());
  ASSERT_EQ(images->pairs.size(), 2u);
  EXPECT_EQ(images->pairs[0].name, "a");
  EXPECT_EQ(images->pairs[1].placement, 2);
  EXPECT_EQ(images->pairs[1].files[1], folder_ / "b_right.png");
}

TEST_F(CalibrationImagesTest, AJobOfTheStationIsAFolderOfImages) {
  Manifest manifest{.id = "20261125-090000-1", .created = "2026-11-25T09:00:00Z", .source = "calibration"};
  PoseRecord third{.name = "pose3", .complete = false, .views = {}};
  for (int index = 0; index < 2; ++index) {
    ViewRecord view{.index = index, .commanded_deg = 30.0 * index, .measured_deg = 30.0 * index + 0.004};
    view.taken = "2026-11-25T09:00:05Z";
    view.pixel_format = "BayerRG8";
    for (const char* side : {"left", "right"}) {
      view.files[fmt::format("{}_plain", side)] = {fmt::format("pose3/view0{}/{}_plain.png", index, side),
                                                   sha256(std::string_view(side))};
    }
    third.views.push_back(view);
  }
  manifest.poses = {
      {.name = "pose1", .complete = false, .views = {}}, {.name = "pose2", .complete = false, .views = {}}, third};
  write_text(folder_ / "scan.json", to_json(manifest));
  const auto images = read_calibration_images(folder_);
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_EQ(images->pixel_format, "BayerRG8");
  ASSERT_EQ(images->pairs.size(), 2u);
  EXPECT_EQ(images->pairs[1].name, "placement 3 image 2");
  EXPECT_EQ(images->pairs[1].table_deg, 30.004);
  EXPECT_EQ(images->pairs[1].files[0], folder_ / "pose3/view01/left_plain.png");

  manifest.poses.assign(8, third);
  write_text(folder_ / "scan.json", to_json(manifest));
  EXPECT_EQ(read_calibration_images(folder_).error().code, ErrorCode::invalid_input);
  manifest.source = "stereo";
  manifest.poses.clear();
  write_text(folder_ / "scan.json", to_json(manifest));
  EXPECT_THAT(read_calibration_images(folder_).error().message, HasSubstr("is not a calibration"));
}

TEST_F(CalibrationImagesTest, AFileWithoutItsPartnerIsNamed) {
  write_text(folder_ / "b_right.png", "");
  EXPECT_THAT(read_calibration_images(folder_).error().message, HasSubstr("b_right.png: has no partner b_left"));
}

TEST_F(CalibrationImagesTest, AFolderWithoutPairsOrThatIsNotThereIsNamed) {
  EXPECT_EQ(read_calibration_images(folder_).error().code, ErrorCode::not_found);
  EXPECT_EQ(read_calibration_images(folder_ / "no").error().code, ErrorCode::not_found);
}

TEST_F(CalibrationImagesTest, AnImageIsTheOneOfTheListOrRefused) {
  CalibrationPair pair;
  pair.sha256[0] = write_image("a_left.png");
  pair.files[0] = folder_ / "a_left.png";
  const auto image = load_calibration_image(pair, 0);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->cols, 64);
  pair.sha256[0] = sha256(std::string_view("another"));
  EXPECT_THAT(load_calibration_image(pair, 0).error().message, HasSubstr("its hash differs"));
  write_text(folder_ / "a_left.png", "no image");
  pair.sha256[0].clear();
  EXPECT_EQ(load_calibration_image(pair, 0).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
