#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/units.h"
#include "sim/scene/figurine.h"
#include "sim/scene/image_sensor.h"
#include "sim/scene/profile.h"
#include "sim/scene/rests.h"
#include "sim/scene/scene.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// One object at rest, ready to be rendered.
struct Stage {
  Object object;
  Transform table_from_object;
  RayCaster rays{object.mesh};
  RoomLight light{object, rays, table_from_object};
  RigGeometry rig;
  DotPattern dots;

  Stage(Object the_object, const Transform& placement, double scale)
      : object(std::move(the_object)), table_from_object(placement), rig(default_rig(scale)), dots(scale) {}
  Radiance operator()(const Eye& camera, std::uint64_t sampling_seed) const {
    return render({object, rays, light, table_from_object}, camera, rig.projector, dots, 0.3, sampling_seed);
  }
};

Object painted_figurine() {
  Object object;
  object.mesh = figurine(1.0);
  object.normals = vertex_normals(object.mesh);
  object.colour = painted_colour();
  return object;
}

double rms_grey(const cv::Mat& a, const cv::Mat& b) {
  return 255.0 * cv::norm(a, b, cv::NORM_L2) / std::sqrt(static_cast<double>(a.total()) * 3.0);
}

TEST(Rendering, HardlyDependsOnTheSamplingSeed) {
  const Stage stage(painted_figurine(), Transform::Identity(), 1.0);
  Radiance a = stage(stage.rig.left, 1), b = stage(stage.rig.left, 2);
  const double sigma = profile().lens_sigma_px;
  for (cv::Mat* m : {&a.pattern, &b.pattern, &a.plain, &b.plain}) cv::GaussianBlur(*m, *m, {}, sigma);
  const double pattern = rms_grey(a.pattern, b.pattern), plain = rms_grey(a.plain, b.plain);
  RecordProperty("pattern_grey_rms", std::to_string(pattern));
  RecordProperty("plain_grey_rms", std::to_string(plain));
  EXPECT_GT(pattern, 0.0);
  EXPECT_LE(pattern, 0.3);
  EXPECT_LE(plain, 0.3);
}

/// Lanczos interpolation, eight taps each way; the image must be smooth.
double sample(const cv::Mat& image, double x, double y) {
  const auto kernel = [](double t) {
    if (std::abs(t) < 1e-9) return 1.0;
    const double a = M_PI * t;
    return 4.0 * std::sin(a) * std::sin(a / 4.0) / (a * a);
  };
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  double sum = 0.0, total = 0.0;
  for (int j = -3; j <= 4; ++j) {
    for (int i = -3; i <= 4; ++i) {
      const double w = kernel(x - x0 - i) * kernel(y - y0 - j);
      sum += w * image.at<float>(y0 + j, x0 + i);
      total += w;
    }
  }
  return sum / total;
}

TEST(Rendering, OfATiltedPlaneMatchesItsGeometry) {
  // A grey sheet in mid-air, tilted both ways. Points of it are looked up in both images at their geometric places; the
  // remaining shift along the rows between the two lookups is the renderer's error.
  TriangleMesh sheet;
  sheet.vertices = {{-25, -25, 0}, {25, -25, 0}, {25, 25, 0}, {-25, 25, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Transform placed = rot_y(-0.3) * Eigen::Translation3d(0.0, 45.0, 0.0) *
                           Eigen::AngleAxisd(to_radians(25.0), Vector3d::UnitY()) *
                           Eigen::AngleAxisd(to_radians(-35.0), Vector3d::UnitX());
  const Transform turntable_from_sheet = rot_y(0.3) * placed;
  const Stage stage(grey(sheet, 0.6F), placed, 1.0);
  std::array<cv::Mat, 2> image;
  const std::array<const Eye*, 2> eyes = {&stage.rig.left, &stage.rig.right};
  for (int i = 0; i < 2; ++i) {
    cv::extractChannel(stage(*eyes[i], 5).pattern, image[i], 1);
    cv::GaussianBlur(image[i], image[i], {}, profile().lens_sigma_px);
  }
  constexpr int kWindows = 8, kSide = 34;
  constexpr double kStep = 0.15;  // mm on the sheet
  double sum = 0.0, squares = 0.0;
  for (int window = 0; window < kWindows * kWindows; ++window) {
    const int across = window % kWindows, down = window / kWindows;
    const Vector2d corner(-21.0 + 5.2 * across, -21.0 + 5.2 * down);
    double numerator = 0.0, denominator = 0.0;
    for (int i = 0; i < kSide * kSide; ++i) {
      const int column = i % kSide, row = i / kSide;
      const Vector3d on_sheet(corner.x() + kStep * column, corner.y() + kStep * row, 0.0);
      const Vector3d point = turntable_from_sheet * on_sheet;
      const Vector2d l = eyes[0]->project(point), r = eyes[1]->project(point);
      const double slope = sample(image[1], r.x() + 0.5, r.y()) - sample(image[1], r.x() - 0.5, r.y());
      numerator += slope * (sample(image[0], l.x(), l.y()) - sample(image[1], r.x(), r.y()));
      denominator += slope * slope;
    }
    const double shift = numerator / denominator;
    sum += shift, squares += shift * shift;
  }
  const double bias = sum / (kWindows * kWindows), rms = std::sqrt(squares / (kWindows * kWindows));
  RecordProperty("bias_px", std::to_string(bias));
  RecordProperty("rms_px", std::to_string(rms));
  EXPECT_LE(std::abs(bias), 0.003);
  EXPECT_LE(rms, 0.01);
}

TEST(Scene, GivesTheSamePixelsForAnyNumberOfThreads) {
  SceneOptions options;
  options.image_scale = 0.25;
  std::array<StereoImages, 2> images;
  for (const int threads : {1, 3}) {
    with_threads(threads, [&] {
      Scene scene(painted_figurine(), {Transform::Identity()}, options);
      images[threads == 3] = scene.shoot(0, 1.0, true, 4);
    });
  }
  EXPECT_EQ(cv::norm(images[0].left, images[1].left, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(images[0].right, images[1].right, cv::NORM_INF), 0.0);
}

TEST(Scene, RepeatsAnExposureAndChangesTheNoiseOfTheNext) {
  SceneOptions options;
  options.image_scale = 0.25;
  Scene scene(grey(box({20.0, 20.0, 20.0}), 0.5F), {Transform(Eigen::Translation3d(0.0, 20.0, 0.0))}, options);
  const cv::Mat first = scene.shoot(0, 0.0, false, 1).left, again = scene.shoot(0, 0.0, false, 1).left;
  const cv::Mat next = scene.shoot(0, 0.0, false, 2).left;
  EXPECT_EQ(cv::norm(first, again, cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(first, next, cv::NORM_INF), 0.0);
}

TEST(Sensor, HasTwoGreyLevelsOfNoiseAtMidGrey) {
  const cv::Mat light(200, 200, CV_32FC3, cv::Scalar::all(128.0 / 255.0));
  const cv::Mat raw = ImageSensor().expose(through_lens(light, 1.0), 77);
  cv::Scalar mean, deviation;
  cv::meanStdDev(raw(cv::Rect(80, 80, 40, 40)), mean, deviation);  // the middle, free of vignetting
  EXPECT_NEAR(mean[0], 128.0, 1.0);
  EXPECT_NEAR(deviation[0], 2.0, 0.15);
}

TEST(Sensor, HasRedAtItsFirstPixel) {
  const cv::Mat light(64, 64, CV_32FC3, cv::Scalar(0.6, 0.4, 0.2));  // RGB
  const cv::Mat raw = ImageSensor().expose(through_lens(light, 1.0), 0);
  EXPECT_NEAR(raw.at<std::uint8_t>(32, 32), 153, 1);
  EXPECT_NEAR(raw.at<std::uint8_t>(32, 33), 102, 1);
  EXPECT_NEAR(raw.at<std::uint8_t>(33, 32), 102, 1);
  EXPECT_NEAR(raw.at<std::uint8_t>(33, 33), 51, 1);
}

TEST(Exposure, OfAWhiteObjectUsesTheRangeWithoutSaturation) {
  SceneOptions options;
  options.image_scale = 0.5;
  Scene scene(grey(box({20.0, 20.0, 20.0}), 0.9F), {Transform(Eigen::Translation3d(0.0, 20.0, 0.0))}, options);
  for (const bool pattern : {true, false}) {
    double highest = 0.0;
    cv::minMaxLoc(scene.shoot(0, 0.4, pattern, 1).left, nullptr, &highest);
    EXPECT_LT(highest, 235.0) << pattern;
    EXPECT_GT(highest, 150.0) << pattern;
  }
}

TEST(Table, IsBlueEverywhereAndBackdropToo) {
  SceneOptions options;
  options.image_scale = 0.25;
  options.noise = false;
  Scene scene(grey(box({20.0, 20.0, 20.0}), 0.5F), {Transform(Eigen::Translation3d(0.0, 20.0, 0.0))}, options);
  cv::Mat colour;
  cv::cvtColor(scene.shoot(0, 0.0, false, 1).left, colour, cv::COLOR_BayerBG2BGR);  // OpenCV's name for RGGB
  for (const cv::Point at : {cv::Point(10, 10), {310, 10}, {10, 230}, {310, 230}, {160, 15}, {60, 160}}) {
    const auto c = colour.at<cv::Vec3b>(at);
    EXPECT_GT(c[0], 2 * c[1]) << at;
    EXPECT_GT(c[0], 2 * c[2]) << at;
  }
  const auto middle = colour.at<cv::Vec3b>(140, 160);
  EXPECT_LT(middle[0], 1.2 * middle[1]);
}

TEST(Profile1, RendersWhatItAlwaysRendered) {
  // Recorded before rigs could be drawn. A grey level is for other versions of the mathematical library.
  SceneOptions options;
  options.image_scale = 0.25;
  options.noise = false;
  Scene scene(grey(box({20.0, 20.0, 20.0}), 0.5F), {Transform(Eigen::Translation3d(0.0, 20.0, 0.0))}, options);
  const auto check = [](const cv::Mat& image, double mean, const std::array<int, 8>& pixels) {
    EXPECT_NEAR(cv::sum(image)[0] / static_cast<double>(image.total()), mean, 1e-3);
    for (int i = 0; i < 8; ++i) EXPECT_NEAR(image.at<std::uint8_t>(25 + 27 * i, 30 + 36 * i), pixels[i], 1) << i;
  };
  const StereoImages pattern = scene.shoot(0, 0.4, true, 1), plain = scene.shoot(0, 0.4, false, 1);
  check(pattern.left, 12.6257, {2, 2, 8, 1, 41, 1, 6, 4});
  check(pattern.right, 12.5531, {8, 1, 10, 2, 52, 1, 3, 3});
  check(plain.left, 34.9754, {16, 7, 18, 8, 85, 6, 15, 6});
  check(plain.right, 34.8626, {16, 7, 18, 8, 84, 6, 15, 6});
}

TEST(Scene, RefusesAnImpossibleResolution) {
  SceneOptions options;
  options.image_scale = 0.0;
  EXPECT_EQ(Scene::create(options).error().code, ErrorCode::out_of_range);
}

}  // namespace
}  // namespace scanrig::sim
