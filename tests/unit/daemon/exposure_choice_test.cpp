#include "daemon/rig/exposure_choice.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

const std::vector<double> kOffered{8.0, 0.25};

/// A screen that is dark in the pattern's light and bright in plain light, as screens are, with an object of these grey
/// values before it.
ExposedPair seen(int object_pattern, int object_plain, int object_px = 64) {
  ExposedPair pair{cv::Mat(256, 256, CV_8UC1, cv::Scalar(30)), cv::Mat(256, 256, CV_8UC1, cv::Scalar(80))};
  const cv::Rect object(96, 96, object_px, object_px);
  for (int y = object.y; y < object.y + object.height; ++y) {
    for (int x = object.x; x < object.x + object.width; ++x) {
      if ((x + y) % 2 == 0) pair.pattern.at<uchar>(y, x) = static_cast<uchar>(object_pattern);
      pair.plain.at<uchar>(y, x) = static_cast<uchar>(object_plain);
    }
  }
  return pair;
}

std::vector<double> wanted(const ExposedPair& left, const ExposedPair& right) {
  return wanted_exposures({left, right}, kOffered);
}

TEST(WantedExposures, ALightObjectBeforeAScreenWantsNone) {
  EXPECT_TRUE(wanted(seen(180, 120), seen(180, 120)).empty());
  EXPECT_TRUE(wanted(seen(180, 20), seen(180, 20)).empty()) << "lit by the pattern only";
}

TEST(WantedExposures, ADarkObjectWantsALongerOneThoughOneCameraOnlySeesIt) {
  EXPECT_EQ(wanted(seen(20, 15), seen(20, 15)), std::vector<double>{8.0});
  EXPECT_EQ(wanted(seen(180, 120), seen(20, 15)), std::vector<double>{8.0});
  EXPECT_TRUE(wanted(seen(20, 15, 16), seen(20, 15, 16)).empty()) << "a shadow of one tile";
}

TEST(WantedExposures, SaturatedDotsWantAShorterOne) {
  EXPECT_EQ(wanted(seen(255, 120), seen(255, 120)), std::vector<double>{0.25});
  EXPECT_TRUE(wanted(seen(255, 120, 6), seen(255, 120, 6)).empty()) << "a highlight";
}

TEST(WantedExposures, AnObjectOfBothWantsBothAndNothingIsTakenThatIsNotOffered) {
  EXPECT_EQ(wanted(seen(255, 120), seen(20, 15)), kOffered);
  EXPECT_TRUE(wanted_exposures({seen(20, 15)}, {}).empty());
  EXPECT_EQ(wanted_exposures({seen(255, 120), seen(20, 15)}, std::vector<double>{0.5}), std::vector<double>{0.5});
}

TEST(WantedExposures, ImagesSmallerThanATileWantNone) {
  const cv::Mat small(8, 8, CV_8UC1, cv::Scalar(5));
  EXPECT_TRUE(wanted_exposures({{small, small}}, kOffered).empty());
}

}  // namespace
}  // namespace scanrig
