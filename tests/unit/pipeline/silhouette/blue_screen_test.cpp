#include "pipeline/silhouette/blue_screen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <random>

namespace scanrig {
namespace {

using Colour = cv::Vec3d;
/// Signed distance to the painted object, positive outside.
using Shape = std::function<double(double x, double y)>;

constexpr int kWidth = 240, kHeight = 200;
const Colour kScreen(140, 45, 15), kGrey(90, 90, 90);

Shape disc(double x0, double y0, double radius) {
  return [=](double x, double y) { return std::hypot(x - x0, y - y0) - radius; };
}
Shape ring(double x0, double y0, double outer, double inner) {
  return [=](double x, double y) {
    const double r = std::hypot(x - x0, y - y0);
    return std::max(r - outer, inner - r);
  };
}

/// Paints shapes over the screen as a lens would show them (edges over about a pixel and a half) and adds noise.
class Scene {
 public:
  Scene() : light_(kHeight, kWidth, kScreen) {}

  Scene& paint(const Shape& shape, const std::function<Colour(int, int, const Colour&)>& colour) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double alpha = 1.0 / (1.0 + std::exp(shape(x, y) / 0.35));
        light_(y, x) = alpha * colour(x, y, light_(y, x)) + (1.0 - alpha) * light_(y, x);
      }
    }
    return *this;
  }
  Scene& paint(const Shape& shape, const Colour& colour) {
    return paint(shape, [colour](int, int, const Colour&) { return colour; });
  }
  [[nodiscard]] cv::Mat3b image() const {
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0.0, 2.0);
    cv::Mat3b out(kHeight, kWidth);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) out(y, x)[c] = cv::saturate_cast<std::uint8_t>(light_(y, x)[c] + noise(random));
      }
    }
    return out;
  }

 private:
  cv::Mat_<Colour> light_;
};

/// Root mean square of the error within `reach` px of the true outline.
double outline_error(const cv::Mat1f& outside, const Shape& truth, double reach = 2.0) {
  double squares = 0.0;
  int count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double d = truth(x, y);
      if (std::abs(d) > reach) continue;
      squares += std::pow(static_cast<double>(outside(y, x)) - d, 2);
      ++count;
    }
  }
  return std::sqrt(squares / count);
}

TEST(BlueScreen, FindsAnOutlineToAFractionOfAPixel) {
  const Shape object = disc(120.3, 98.6, 55.2);
  const auto outside = blue_screen_outline(Scene().paint(object, kGrey).image());
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_LT(outline_error(*outside, object), 0.12);
  EXPECT_LT(outline_error(*outside, object, 40.0), 0.5);
}

TEST(BlueScreen, SeesTheScreenThroughALoop) {
  const Shape object = ring(120, 100, 60, 12);
  const auto outside = blue_screen_outline(Scene().paint(object, kGrey).image());
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_GT((*outside)(100, 120), 10.0f);
  EXPECT_LT(outline_error(*outside, object), 0.15);
}

TEST(BlueScreen, TakesNeitherShadowNorTableMarkNorSpeckForTheObject) {
  const Shape object = disc(110, 90, 45);
  Scene scene;
  scene.paint(disc(150, 140, 40), [](int, int, const Colour& below) { return 0.25 * below; });  // shadow
  for (int i = 0; i < 8; ++i) scene.paint(disc(20 + 28 * i, 185, 2.5), Colour(170, 75, 40));    // marks of the table
  scene.paint(disc(30, 30, 1.5), Colour(200, 200, 200));                                        // dust
  const auto outside = blue_screen_outline(scene.paint(object, kGrey).image());
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_LT(outline_error(*outside, object), 0.2);
  EXPECT_GT((*outside)(185, 20), 50.0f);
  EXPECT_GT((*outside)(30, 30), 50.0f);
  EXPECT_GT((*outside)(160, 160), 30.0f);
}

TEST(BlueScreen, KeepsTheFootOfAnObjectThatReflectsTheTable) {
  const Shape object = disc(120, 100, 50);
  const auto spill = [](int, int y, const Colour&) {
    const double share = std::clamp((y - 110) / 40.0, 0.0, 1.0);
    return Colour(kGrey * (1.0 - 0.5 * share) + share * 0.3 * kScreen);
  };
  const auto outside = blue_screen_outline(Scene().paint(object, spill).image());
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_LT(outline_error(*outside, object), 0.2);
}

TEST(BlueScreen, KeepsHighlightsAndDarkSpots) {
  const Shape object = disc(120, 100, 50);
  Scene scene;
  scene.paint(object, kGrey).paint(disc(110, 90, 2.5), kScreen).paint(disc(130, 110, 8), Colour(4, 4, 4));
  const auto outside = blue_screen_outline(scene.image());
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_LT((*outside)(90, 110), -20.0f);
  EXPECT_LT((*outside)(110, 130), -20.0f);
}

/// The scene in the pattern's light: spots of 4 px, twice as bright as the plain light, and gaps that are nearly dark.
cv::Mat3b in_pattern(Scene scene) {
  return scene
      .paint([](double, double) { return -10.0; },
             [](int x, int y, const Colour& below) { return ((x / 4 + y / 4) % 2 == 0 ? 2.0 : 0.05) * below; })
      .image();
}

TEST(BlueScreen, KeepsADarkSurfaceThatMirrorsTheScreenWhereThePatternLightsIt) {
  const Shape object = ring(120, 100, 60, 12);
  const Colour dark(12, 12, 12), mirrored = Colour(0.5 * dark + 0.4 * kScreen);
  Scene plain, lit;
  plain.paint(object, dark).paint(disc(120, 60, 9), mirrored).paint(disc(85, 100, 14), mirrored);
  lit.paint(object, dark);
  const auto pattern = in_pattern(lit);
  const auto without = blue_screen_outline(plain.image()), with = blue_screen_outline(plain.image(), pattern);
  ASSERT_TRUE(without && with);
  EXPECT_GT((*without)(60, 120), 0.0f) << "else this test shows nothing";
  EXPECT_LT((*with)(60, 120), -10.0f);
  EXPECT_LT((*with)(100, 85), -10.0f);
  EXPECT_GT((*with)(100, 120), 8.0f) << "the loop shows the screen in both lights";
  EXPECT_LT(outline_error(*with, object), 0.25);
}

TEST(BlueScreen, ThePatternsLightDoesNotMoveTheOutline) {
  const Shape object = disc(120.3, 98.6, 55.2);
  const cv::Mat3b plain = Scene().paint(object, kGrey).image(), pattern = in_pattern(Scene().paint(object, kGrey));
  const auto outside = blue_screen_outline(plain, pattern);
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_LT(outline_error(*outside, object), 0.12);
}

TEST(BlueScreen, DoesNotTakeNoiseForAnObjectWhereTheProjectorDoesNotReach) {
  const Shape object = disc(120.3, 98.6, 55.2);
  const cv::Mat3b plain = Scene().paint(object, kGrey).image();
  // The screen's light and that of a black level, hardly brighter than noise.
  const cv::Mat3b dark = Scene().paint(disc(120, 100, 500), Colour(8, 4, 4)).image();
  const cv::Mat3b pattern = in_pattern(Scene().paint(object, kGrey));
  dark(cv::Rect(0, 0, 70, 50)).copyTo(pattern(cv::Rect(0, 0, 70, 50)));
  const auto outside = blue_screen_outline(plain, pattern);
  ASSERT_TRUE(outside) << outside.error().message;
  EXPECT_LT(outline_error(*outside, object), 0.12);
  EXPECT_GT((*outside)(20, 20), 30.0f);
}

TEST(BlueScreen, RefusesAPatternOfAnotherSize) {
  const auto outside = blue_screen_outline(Scene().paint(disc(120, 100, 50), kGrey).image(), cv::Mat3b(10, 10));
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, ErrorCode::invalid_input);
}

TEST(BlueScreen, ReportsAMissingObject) {
  const auto outside = blue_screen_outline(Scene().image());
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, ErrorCode::not_found);
}

TEST(BlueScreen, LearnsTheColourOfTheScreenFromTheBorder) {
  const Shape object = disc(120.3, 98.6, 55.2);
  cv::Mat3b image = Scene().paint(object, Colour(95, 55, 40)).image();  // bluish, but not as blue as the screen
  const auto before_blue = blue_screen_outline(image);
  ASSERT_TRUE(before_blue);
  for (cv::Vec3b& pixel : image) pixel = {pixel[1], pixel[0], pixel[2]};
  const auto before_green = blue_screen_outline(image);
  ASSERT_TRUE(before_green) << before_green.error().message;
  EXPECT_EQ(cv::countNonZero(*before_green != *before_blue), 0);
  cv::Mat3b blue_object = Scene().paint(object, kScreen).image();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (object(x, y) > 0.0) blue_object(y, x) = {45, 140, 15};
    }
  }
  const auto blue_before_green = blue_screen_outline(blue_object);
  ASSERT_TRUE(blue_before_green) << blue_before_green.error().message;
  EXPECT_LT(outline_error(*blue_before_green, object), 0.5);
}

TEST(BlueScreen, ReportsADarkBorder) {
  const auto outside = blue_screen_outline(cv::Mat3b(kHeight, kWidth, cv::Vec3b(2, 1, 1)));
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, ErrorCode::degenerate);
}

TEST(BlueScreen, ReportsAScreenWithoutColour) {
  const auto outside = blue_screen_outline(cv::Mat3b(kHeight, kWidth, cv::Vec3b(80, 80, 80)));
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, ErrorCode::not_found);
  EXPECT_NE(outside.error().message.find("colour"), std::string::npos);
}

TEST(BlueScreen, ReportsAnObjectAtTheBorder) {
  const auto outside = blue_screen_outline(Scene().paint(disc(120, 30, 50), kGrey).image());
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, ErrorCode::out_of_range);
  EXPECT_NE(outside.error().message.find("larger than the working volume"), std::string::npos);
}

TEST(BlueScreen, RefusesGreyAndDeepImages) {
  for (const cv::Mat& image : {cv::Mat(kHeight, kWidth, CV_8UC1), cv::Mat(kHeight, kWidth, CV_16UC3), cv::Mat()}) {
    const auto outside = blue_screen_outline(image);
    ASSERT_FALSE(outside);
    EXPECT_EQ(outside.error().code, ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace scanrig
