#include "sim/scene/lens.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "sim/scene/image_sensor.h"

namespace scanrig::sim {
namespace {

Effects only(std::string_view names) { return choose_effects("workshop", names, "").value(); }

/// All effects but those of the lens are off; `without` of those.
Effects optics(std::string_view without = "") {
  std::string names = "sensor,projector,materials,turntable,drift,room";
  if (!without.empty()) names += "," + std::string(without);
  return only(names);
}

constexpr int kWidth = 1280, kHeight = 960;

/// Centre and second moments of one colour's image of a point of light.
struct PointImage {
  Eigen::Vector2d centre;
  Eigen::Matrix2d spread;  // px squared
};

/// A point of light at (x, y) is moved over all places within two pixels, as only every second pixel has a red or blue
/// filter: the moments are then those of the continuous image.
PointImage image_of_point(const Lens& lens, int x, int y, int channel) {
  double sum = 0.0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (int step = 0; step < 4; ++step) {
    const int px = x + step % 2, py = y + step / 2;
    cv::Mat light(kHeight, kWidth, CV_32FC3, cv::Scalar::all(0));
    light.at<cv::Vec3f>(py, px) = {1.0F, 1.0F, 1.0F};
    const cv::Mat image = lens.image(light);
    for (int j = -12; j <= 12; ++j) {
      for (int i = -12; i <= 12; ++i) {
        const int u = px + i, v = py + j;
        if (u < 0 || v < 0 || u >= kWidth || v >= kHeight || (u & 1) + (v & 1) != channel) continue;
        const double value = image.at<float>(v, u);
        const Eigen::Vector2d off(i, j);
        sum += value, first += value * off, second += value * off * off.transpose();
      }
    }
  }
  const Eigen::Vector2d centre = first / sum;
  return {centre, second / sum - centre * centre.transpose()};
}

TEST(Lens, BlursMoreInTheCornerThanInTheCentre) {
  const Lens lens(optics("lens-pair,astigmatism,chromatic"), true, 1.0);
  const PointImage centre = image_of_point(lens, 640, 480, 1), corner = image_of_point(lens, 1260, 940, 1);
  EXPECT_NEAR(std::sqrt(0.5 * centre.spread.trace()), 0.5, 0.03);
  EXPECT_NEAR(std::sqrt(0.5 * corner.spread.trace()), 0.9, 0.04);
}

TEST(Lens, IsAstigmaticAlongTheRadius) {
  const Lens lens(optics("lens-pair,chromatic"), true, 1.0);
  const PointImage corner = image_of_point(lens, 1260, 940, 1);
  const Eigen::Vector2d along = Eigen::Vector2d(620.5, 460.5).normalized(), across(-along.y(), along.x());
  const double radial = std::sqrt(along.dot(corner.spread * along)),
               tangential = std::sqrt(across.dot(corner.spread * across));
  EXPECT_NEAR(radial / tangential, 1.3, 0.05);
  EXPECT_NEAR(std::sqrt(radial * tangential), 0.9, 0.04);
}

TEST(Lens, ImagesRedLargerThanBlue) {
  const Lens lens(optics(), true, 1.0);
  const PointImage red = image_of_point(lens, 1260, 940, 0), blue = image_of_point(lens, 1260, 940, 2);
  const Eigen::Vector2d apart = red.centre - blue.centre, outwards = Eigen::Vector2d(620.5, 460.5).normalized();
  EXPECT_NEAR(apart.dot(outwards), 0.3 * 772.7 / 799.4, 0.03);
  EXPECT_NEAR(apart.norm(), apart.dot(outwards), 0.02);
  const PointImage middle = image_of_point(lens, 640, 480, 0);
  EXPECT_LT(middle.centre.norm(), 0.02);
}

TEST(Lens, DiffersFromItsNeighbour) {
  const Lens left(optics(), true, 1.0), right(optics(), false, 1.0);
  EXPECT_NEAR(right.blur(0.3).radial / left.blur(0.3).radial, 1.1 / 0.9, 1e-9);
  const Lens alike(optics("lens-pair"), true, 1.0);
  EXPECT_NEAR(alike.blur(0.0).radial, 0.5, 1e-9);
}

TEST(Lens, KeepsTheLight) {
  const cv::Mat light(240, 320, CV_32FC3, cv::Scalar(0.7, 0.5, 0.3));
  const cv::Mat image = Lens(optics(), true, 0.25).image(light, 2.5);
  for (const cv::Point at : {cv::Point(0, 0), {319, 0}, {160, 120}, {318, 238}}) {
    EXPECT_NEAR(image.at<float>(at), at.x % 2 == 0 ? 0.7F : at.y % 2 == 0 ? 0.5F : 0.3F, 1e-4) << at;
  }
}

TEST(Lens, WithoutItsEffectsIsThatOfProfile1) {
  cv::Mat light(60, 80, CV_32FC3);
  cv::randu(light, 0.0, 1.0);
  const cv::Mat image = Lens(optics("blur,astigmatism,lens-pair,chromatic"), false, 1.0).image(light, 1.0);
  EXPECT_EQ(cv::norm(image, through_lens(light, 1.0, 1.0), cv::NORM_INF), 0.0);
}

TEST(Lens, GivesTheSameBitsForAnyNumberOfThreads) {
  cv::Mat light(120, 160, CV_32FC3), one, three;
  cv::randu(light, 0.0, 1.0);
  const Lens lens(optics(), true, 1.0);
  with_threads(1, [&] { one = lens.image(light); });
  with_threads(3, [&] { three = lens.image(light); });
  EXPECT_EQ(cv::norm(one, three, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace scanrig::sim
