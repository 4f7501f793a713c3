#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/files.h"
#include "core/image_codec.h"
#include "pipeline/characterise/characterisation_file.h"
#include "pipeline/characterise/flat_folder.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CharacterisationFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = own_folder();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write_image(const std::string& name, int grey, int rows = 8) {
    const auto bytes = encode_png(cv::Mat(rows, 8, CV_8U, cv::Scalar(grey)));
    ASSERT_TRUE(bytes);
    ASSERT_TRUE(write_file_atomically(folder_ / name, *bytes));
  }

  fs::path folder_;
};

TEST_F(CharacterisationFiles, FlatsArePairedByTheirNames) {
  int grey = 10;
  for (const char* name : {"left_dark_01", "left_dark_02", "left_dark_03", "left_dark_04", "left_2000us_01",
                           "left_2000us_02", "left_500us_07", "left_500us_09", "right_dark_1", "right_dark_2"}) {
    write_image(std::string(name) + ".png", grey++);
  }
  write_image("left_notes.png", 1);
  std::ofstream(folder_ / kFlatList) << flat_list({"A1", "B2"}, {"0.5", ""});
  const auto flats = read_flat_folder(folder_);
  ASSERT_TRUE(flats) << flats.error().message;
  EXPECT_EQ(flats->serials[0], "A1");
  EXPECT_EQ(flats->serials[1], "B2");
  EXPECT_EQ(flats->gain_settings[0], "0.5");
  ASSERT_EQ(flats->pairs[0].size(), 4U);
  const std::vector<std::pair<double, int>> expected{{0.0, 10}, {0.0, 12}, {500.0, 16}, {2000.0, 14}};
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(flats->pairs[0][k].exposure_us, expected[k].first);
    EXPECT_EQ(flats->pairs[0][k].first.at<std::uint8_t>(0, 0), expected[k].second);
    EXPECT_EQ(flats->pairs[0][k].second.at<std::uint8_t>(0, 0), expected[k].second + 1);
  }
  EXPECT_EQ(flats->pairs[1].size(), 1U);
}

TEST_F(CharacterisationFiles, AnImageWithoutItsPartnerIsNamed) {
  write_image("left_dark_01.png", 10);
  write_image("left_dark_02.png", 10);
  write_image("left_2000us_01.png", 10);
  const auto flats = read_flat_folder(folder_);
  ASSERT_FALSE(flats);
  EXPECT_EQ(flats.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(flats.error().message, HasSubstr("left_2000us_01.png: one image of the pair only; take both"));
}

TEST_F(CharacterisationFiles, AFolderWithoutFlatsIsRefused) {
  const auto empty = read_flat_folder(folder_);
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, ErrorCode::not_found);
  EXPECT_THAT(empty.error().message, HasSubstr("no flat image such as left_2000us_01.png"));
  const auto missing = read_flat_folder(folder_ / "no");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
}

CharacterisationFile two_cameras() {
  SensorCharacterisation one;
  one.serial = "A1";
  one.gain_setting = "0.5";
  one.width = 640;
  one.height = 480;
  one.gain = 0.08;
  one.gain_sigma = 0.0003;
  one.black = 6.0;
  one.read_noise = 0.8;
  one.prnu = 0.012;
  one.column = 0.5;
  one.saturation = 255.0;
  one.hot_pixels = {{3, 4, 25.5}};
  one.curve = {{0.0, 6.0, 0.7}, {500.0, 46.0, 3.9}};
  one.remarks = {"raise it"};
  SensorCharacterisation other = one;
  other.serial = "B2";
  other.prnu = std::numeric_limits<double>::quiet_NaN();
  other.saturation = other.prnu;
  return {"2026-11-26T10:00:00Z", {one, other}};
}

TEST_F(CharacterisationFiles, ReadBackAsTheyWereWritten) {
  const auto file = folder_ / kCharacterisationFile;
  const auto written = two_cameras();
  std::ofstream(file) << encode_characterisation(written);
  const auto read = read_characterisation(file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(encode_characterisation(*read), encode_characterisation(written));
  EXPECT_TRUE(std::isnan(read->cameras[1].saturation));
  EXPECT_EQ(read->cameras[0].hot_pixels[0].y, 4);
  const auto noise = noise_model_of(file, "B2");
  ASSERT_TRUE(noise);
  EXPECT_TRUE(noise->is_measured);
  EXPECT_EQ(noise->gain, 0.08);
  EXPECT_EQ(noise->prnu, NoiseModel{}.prnu);
}

TEST_F(CharacterisationFiles, OfAnotherCameraAreRefusedAndNoneIsTheAssumption) {
  const auto file = folder_ / kCharacterisationFile;
  const auto none = noise_model_of(file, "A1");
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->is_measured);
  std::ofstream(file) << encode_characterisation(two_cameras());
  const auto other = noise_model_of(file, "C3");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::not_found);
  EXPECT_THAT(other.error().message, HasSubstr("is of camera A1 and B2, not of C3; run scanrig camera characterise"));
}

TEST_F(CharacterisationFiles, WithAWrongKeyNameIt) {
  const auto file = folder_ / kCharacterisationFile;
  std::string text = encode_characterisation(two_cameras());
  text.replace(text.find("\"gain\""), 6, "\"gone\"");
  std::ofstream(file) << text;
  const auto read = read_characterisation(file);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(read.error().message, HasSubstr("gain"));
}

}  // namespace
}  // namespace scanrig
