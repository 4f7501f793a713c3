#include "daemon/rig/image_checker.h"

#include <gmock/gmock.h>

namespace scanrig {
namespace {

using testing::HasSubstr;

StereoFrame frame(ImageQuality left, ImageQuality right, double left_right_correlation = 0.0) {
  StereoFrame made;
  made.left_evidence = left;
  made.right_evidence = right;
  made.left_right_correlation = left_right_correlation;
  return made;
}

constexpr ImageQuality kGood{0.05, 0.0, 1.2};

class PictureJudgeTest : public testing::Test {
 protected:
  void expect_refused(Light light, const StereoFrame& bad, const std::string& words) {
    const auto judged = image_checker_.judge(light, bad);
    ASSERT_FALSE(judged) << words;
    EXPECT_EQ(judged.error().code, ErrorCode::protocol);
    EXPECT_THAT(judged.error().message, HasSubstr(words));
  }
  ImageChecker image_checker_;
};

TEST_F(PictureJudgeTest, GoodPicturesPassAndSoDoThoseNobodyMeasured) {
  EXPECT_TRUE(image_checker_.judge(Light::pattern, frame(kGood, kGood)));
  EXPECT_TRUE(image_checker_.judge(Light::pattern, frame({}, {}, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_TRUE(image_checker_.judge(Light::pattern, frame({0.06, 0.01, 1.4}, {0.04, 0.0, 1.1})));
}

TEST_F(PictureJudgeTest, ADarkPictureIsNamedWithItsSideAndLight) {
  expect_refused(Light::pattern, frame(kGood, {0.012, 0.0, 1.2}), "right camera: the pattern image is dark (0.012");
  expect_refused(Light::plain, frame({0.012, 0.0, 1.2}, kGood), "left camera: the plain image is dark");
}

TEST_F(PictureJudgeTest, APictureMuchDarkerThanTheViewsBeforeIsDark) {
  ASSERT_TRUE(image_checker_.judge(Light::plain, frame({0.30, 0.0, 1.2}, {0.30, 0.0, 1.2})));
  EXPECT_TRUE(image_checker_.judge(Light::pattern, frame({0.10, 0.0, 1.2}, {0.10, 0.0, 1.2})))
      << "the pattern is another light";
  expect_refused(Light::plain, frame({0.30, 0.0, 1.2}, {0.10, 0.0, 1.2}), "0.100 of full scale, 0.300 in the views");
  image_checker_.begin();
  EXPECT_TRUE(image_checker_.judge(Light::plain, frame({0.10, 0.0, 1.2}, {0.10, 0.0, 1.2})))
      << "another job, another object";
}

TEST_F(PictureJudgeTest, AnOverexposedPictureIsNamed) {
  expect_refused(Light::plain, frame(kGood, {0.9, 0.4, 1.2}), "right camera: the plain image is overexposed");
}

TEST_F(PictureJudgeTest, APictureMoreBlurredThanTheViewsBeforeIsNamed) {
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(image_checker_.judge(Light::pattern, frame(kGood, kGood)));
  expect_refused(Light::pattern, frame({0.05, 0.0, 2.3}, kGood), "left camera: the pattern image is blurred (2.3 px");
  EXPECT_TRUE(image_checker_.judge(Light::plain, frame({0.05, 0.0, 2.3}, kGood)))
      << "an object may have no fine texture";
}

TEST_F(PictureJudgeTest, OnePictureOnBothSidesIsNamed) {
  expect_refused(Light::pattern, frame(kGood, kGood, 0.8), "left and right show the same image");
  EXPECT_TRUE(image_checker_.judge(Light::plain, frame(kGood, kGood, 0.8))) << "evenly lit objects may look alike";
}

TEST_F(PictureJudgeTest, WhatWasRefusedIsNoMeasureForTheNext) {
  ASSERT_TRUE(image_checker_.judge(Light::pattern, frame(kGood, kGood)));
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(image_checker_.judge(Light::pattern, frame({0.05, 0.0, 2.3}, kGood)));
  EXPECT_TRUE(image_checker_.judge(Light::pattern, frame(kGood, kGood)));
}

}  // namespace
}  // namespace scanrig
