#include "sim/scene/rest_error.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scanrig::sim {
namespace {

TEST(RestingTable, IsEquallyFarOffEveryTimeAndInTheNextJob) {
  for (const double angle : {-45.0, 0.0, 45.0, 315.0, 360.0}) {
    EXPECT_EQ(rest_error_deg(angle, 1), rest_error_deg(angle, 1));
    EXPECT_EQ(rest_error_deg(angle, 1), rest_error_deg(angle + 720.0, 1));
  }
}

TEST(RestingTable, IsOffByTheRepeatabilityOfTheProfileAndNeverTheSameWayTwiceInAJob) {
  double squares = 0.0;
  constexpr int kPlaces = 720;
  for (int deg = 0; deg < kPlaces; ++deg) squares += std::pow(rest_error_deg(deg, 5), 2.0);
  EXPECT_NEAR(std::sqrt(squares / kPlaces), profile().repeatability_deg, 0.1 * profile().repeatability_deg);
  EXPECT_NE(rest_error_deg(45.0, 1), rest_error_deg(405.0, 1));
  EXPECT_NE(rest_error_deg(45.0, 1), rest_error_deg(45.0, 2));
}

TEST(Encoder, ReadsAWholeNumberOfItsSteps) {
  EXPECT_EQ(encoder_reading(45.0021), 45.004);
  EXPECT_EQ(encoder_reading(-0.0019), 0.0);
}

}  // namespace
}  // namespace scanrig::sim
