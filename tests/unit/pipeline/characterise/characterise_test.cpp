#include "pipeline/characterise/characterise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/pipeline/characterise/photon_camera.h"

namespace scanrig {
namespace {

using photon_camera::Camera;
using photon_camera::series;
using testing::HasSubstr;

/// That of the camera as it is by default, exposed once for all tests.
const std::vector<FlatPair>& plain_series() {
  static const std::vector<FlatPair> pairs = series(Camera{});
  return pairs;
}

SensorCharacterisation found_of(const std::vector<FlatPair>& pairs, const CharacteriseOptions& options = {}) {
  auto found = characterise(pairs, options);
  EXPECT_TRUE(found) << found.error().message;
  return found ? *found : SensorCharacterisation{};
}

std::vector<FlatPair> with(std::vector<FlatPair> pairs, const std::vector<FlatPair>& more) {
  pairs.insert(pairs.end(), more.begin(), more.end());
  return pairs;
}

std::string refusal(const std::vector<FlatPair>& pairs, const CharacteriseOptions& options = {}) {
  const auto found = characterise(pairs, options);
  EXPECT_FALSE(found);
  if (found) return "";
  EXPECT_EQ(found.error().code, ErrorCode::invalid_input);
  return found.error().message;
}

void expect_is(const SensorCharacterisation& found, const Camera& camera) {
  EXPECT_NEAR(found.gain, camera.gain, 0.03 * camera.gain);
  EXPECT_NEAR(found.gain, camera.gain, 4.0 * found.gain_sigma + 0.01 * camera.gain);
  EXPECT_NEAR(found.black, camera.black, 0.02 * camera.black);
  const double read_noise = camera.gain * camera.read_e;
  EXPECT_NEAR(found.read_noise, read_noise, 0.05 * read_noise);
  EXPECT_NEAR(found.prnu, camera.prnu, 0.05 * camera.prnu);
  EXPECT_NEAR(found.column, camera.column, 0.08 * camera.column);
  EXPECT_LT(found.row, 0.2 * camera.column);
}

TEST(Characterise, FindsWhatThePhotonsWereCountedWith) {
  const Camera camera;
  const auto found = found_of(plain_series());
  expect_is(found, camera);
  EXPECT_LT(found.linearity_error, 0.01);
  EXPECT_TRUE(found.hot_pixels.empty());
  EXPECT_TRUE(std::isnan(found.saturation));
  EXPECT_EQ(found.curve.size(), 7U);
  EXPECT_TRUE(found.remarks.empty()) << found.remarks[0];
}

TEST(Characterise, AnotherCameraHasOtherFigures) {
  Camera camera;
  camera.gain = 0.03;
  camera.read_e = 30.0;
  camera.black = 9.0;
  camera.prnu = 0.02;
  camera.column = 0.3;
  camera.electrons_per_us = 2.6;
  camera.seed = 5;
  expect_is(found_of(series(camera)), camera);
}

TEST(Characterise, UnevenPaperAndFlickerAreNoNoise) {
  Camera camera;
  camera.paper_slope = 0.6;
  camera.flicker = 0.02;
  camera.electrons_per_us = 1.1;
  const auto found = found_of(series(camera));
  expect_is(found, camera);
  EXPECT_GT(found.light_change, 0.005);
}

TEST(Characterise, LightThatFallsOffToTheCornersIsNoFixedPattern) {
  Camera camera;
  camera.fall_off = 0.5;
  camera.prnu = 0.006;
  camera.seed = 9;
  const auto found = found_of(series(camera));
  EXPECT_NEAR(found.prnu, camera.prnu, 0.05 * camera.prnu);
}

TEST(Characterise, TwelveBitsAreCountedInTheirOwnGreyValues) {
  Camera camera;
  camera.bits = 12;
  camera.gain = 1.2;
  camera.black = 90.0;
  camera.column = 7.0;
  expect_is(found_of(series(camera), {.bits = 12}), camera);
}

TEST(Characterise, FindsEveryHotPixelAndNoOther) {
  Camera camera;
  std::set<std::pair<int, int>> planted;
  for (int k = 0; k < 40; ++k) camera.hot.emplace_back((k * 97) % camera.width, (k * 61) % camera.height);
  for (const auto& hot : camera.hot) planted.emplace(hot.x, hot.y);
  const auto found = found_of(series(camera));
  std::set<std::pair<int, int>> known;
  for (const auto& hot : found.hot_pixels) {
    known.emplace(hot.x, hot.y);
    EXPECT_NEAR(hot.excess, 25.0, 5.0);
  }
  EXPECT_EQ(known, planted);
  expect_is(found, camera);  // they spoil nothing
}

TEST(Characterise, ASaturatedExposureTellsTheSaturation) {
  const Camera camera;
  auto pairs = plain_series();
  pairs.push_back(photon_camera::pair(camera, 12000.0, 50));
  const auto found = found_of(pairs);
  EXPECT_NEAR(found.saturation, 255.0, 0.5);
  EXPECT_NEAR(found.full_well(), (255.0 - 6.0) / 0.08, 100.0);
  expect_is(found, camera);
}

TEST(Characterise, GammaIsRefusedAndMadeLinearWhereItIsNamed) {
  Camera camera;
  camera.gamma = 0.45;
  const auto pairs = series(camera);
  EXPECT_THAT(refusal(pairs), HasSubstr("coded with a gamma of 0.45, not 1.00"));
  const auto found = found_of(pairs, {.gamma = 0.45});
  EXPECT_NEAR(found.gain, camera.gain, 0.05 * camera.gain);
  EXPECT_NEAR(found.black, camera.black, 0.05 * camera.black);
  EXPECT_NEAR(found.prnu, camera.prnu, 0.1 * camera.prnu);
  // Linear images with gamma named.
  EXPECT_THAT(refusal(plain_series(), {.gamma = 0.45}), HasSubstr("coded with a gamma of 1.00, not 0.45"));
}

TEST(Characterise, NamesAFlatThatIsExposedTooLongOrTooShort) {
  const Camera camera;
  auto pairs = plain_series();
  pairs.push_back(photon_camera::pair(camera, 3600.0, 60));
  EXPECT_THAT(refusal(pairs), HasSubstr("left_3600us: overexposed, "));
  pairs.back() = photon_camera::pair(camera, 20.0, 61);
  EXPECT_THAT(refusal(pairs), HasSubstr("left_20us: underexposed, grey "));
}

TEST(Characterise, RefusesPairsThatAreNone) {
  const auto& good = plain_series();
  auto pairs = good;
  pairs[4].second = cv::Mat();
  EXPECT_THAT(refusal(pairs), HasSubstr("left_250us: one image of the pair only"));
  pairs = good;
  pairs[4].second = pairs[4].second.rowRange(0, 400).clone();
  EXPECT_THAT(refusal(pairs), HasSubstr("left_250us: is of 640 x 400 pixels, left_dark of 640 x 512"));
  pairs = good;
  cv::merge(std::vector<cv::Mat>(3, pairs[4].second), pairs[4].second);
  EXPECT_THAT(refusal(pairs), HasSubstr("left_250us: is not a raw image"));
  pairs = good;
  pairs[5].second = pairs[6].second;
  EXPECT_THAT(refusal(pairs), HasSubstr("left_500us: the light changed by"));
}

TEST(Characterise, RefusesTooFewExposures) {
  const auto& all = plain_series();
  const std::vector<FlatPair> dark(all.begin(), all.begin() + 3), lit(all.begin() + 3, all.end());
  EXPECT_THAT(refusal(with(dark, {lit[2], lit[5]})), HasSubstr("2 exposures, the longest 5.0 times"));
  EXPECT_THAT(refusal(with(dark, {lit[3], lit[4], lit[5]})), HasSubstr("the longest 2.5 times"));
  EXPECT_THAT(refusal(lit), HasSubstr("no dark pair"));
  EXPECT_THAT(refusal(dark), HasSubstr("no lit pair"));
}

TEST(Characterise, RefusesImagesWhoseNoiseIsTakenOut) {
  Camera camera;
  camera.is_smoothed = true;
  EXPECT_THAT(refusal(series(camera)), HasSubstr("noise does not grow with light"));
}

TEST(Characterise, AsksForAHigherBlackLevelWhereItIsCutOff) {
  Camera camera;
  camera.black = 1.0;
  const auto found = found_of(series(camera));
  ASSERT_EQ(found.remarks.size(), 1U);
  EXPECT_THAT(found.remarks[0], HasSubstr("of the dark pixels are at 0: raise the camera's black level"));
  // The dark images alone would give less.
  EXPECT_NEAR(found.read_noise, 0.8, 0.05);
}

TEST(NoiseModelTest, IsThatOfTheImages) {
  const NoiseModel noise = found_of(plain_series()).noise_model();
  EXPECT_TRUE(noise.is_measured);
  EXPECT_FALSE(NoiseModel{}.is_measured);
  // 100 grey values over black are 1250 electrons, whose variance is 1250.
  EXPECT_NEAR(noise.variance(106.0), 0.64 + 1.0 / 12.0 + 0.08 * 0.08 * 1250.0, 0.3);
  EXPECT_NEAR(noise.variance(0.0), 0.64 + 1.0 / 12.0, 0.06);
  EXPECT_NEAR(noise.fixed_variance(106.0), 1.2 * 1.2 + 0.25, 0.2);
  EXPECT_GT(NoiseModel{}.variance(200.0), NoiseModel{}.variance(20.0));
}

}  // namespace
}  // namespace scanrig
