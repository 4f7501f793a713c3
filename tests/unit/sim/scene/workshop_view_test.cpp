#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/hash.h"
#include "core/parallel.h"
#include "core/units.h"
#include "sim/scene/scene.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::string_view kAllFamilies = "optics,sensor,projector,materials,turntable,drift,room";

/// Profile 2 with these effects alone.
Effects alone(std::initializer_list<std::string_view> names) {
  Effects effects;
  for (const Effect& effect : workshop_effects()) {
    for (const auto name : names) {
      if (effect.name != name) continue;
      for (const auto& size : effect.sizes) effects.*size.member = size.value;
    }
  }
  return effects;
}

SceneOptions small(const Effects& effects, double scale = 0.25) {
  SceneOptions options;
  options.image_scale = scale, options.noise = false, options.profile.effects = effects;
  return options;
}

/// A block of 40 mm a side, just above the table.
Scene block(const SceneOptions& options) {
  Object object = grey(box({20.0, 20.0, 20.0}), 0.6F);
  object.materials = Materials::named(options.profile.material_name(), options.profile.effects).value();
  return Scene(std::move(object), {Transform(Eigen::Translation3d(0.0, 22.0, 0.0))}, options);
}

cv::Vec3f at(const cv::Mat& mosaic, const Eye& eye, const Vector3d& point) {
  // Red, green and blue of the pixels around.
  const Vector2d p = eye.project(point);
  const int x = static_cast<int>(p.x()) & ~1, y = static_cast<int>(p.y()) & ~1;
  return {mosaic.at<float>(y, x), mosaic.at<float>(y, x + 1), mosaic.at<float>(y + 1, x + 1)};
}

TEST(Profile1, IsTheSameToTheBit) {
  // libm and Embree decide the last bits: these are those of Debian 12.
  double probe = 0.0;
  for (int i = 1; i < 2000; ++i) probe += std::sin(0.37 * i) * std::exp(-0.001 * i) + std::pow(0.01 * i, 1.7);
  if (fmt::format("{:a}", probe) != "0x1.d6dcb1aa1e543p+16")
    GTEST_SKIP() << "another mathematical library: " << fmt::format("{:a}", probe);
  SceneOptions options;
  options.image_scale = 0.25;
  auto scene = Scene::create(options);
  ASSERT_TRUE(scene);
  std::string images;
  for (const bool pattern : {true, false}) {
    const StereoImages pair = (*scene)->shoot(0, 0.4, pattern, 3);
    for (const cv::Mat& image : {pair.left, pair.right})
      images.append(reinterpret_cast<const char*>(image.data), image.total());
  }
  EXPECT_EQ(sha256(images), "1e66e9cb5f2f2678970fc44fa81b3bfac51e1123836ad2bee02bb7798264b55b");
}

TEST(Workshop, GivesTheSameBitsForAnyNumberOfThreads) {
  SceneOptions options = small(choose_effects("workshop", "", "handling").value(), 0.15);
  options.noise = true;
  options.profile.material = "gloss+translucent+metal";
  std::array<StereoImages, 2> images;
  for (const int threads : {1, 3}) {
    with_threads(threads, [&] {
      Scene scene = block(options);
      images[threads == 3] = scene.shoot(0, 1.0, true, 4);
    });
  }
  EXPECT_EQ(cv::norm(images[0].left, images[1].left, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(images[0].right, images[1].right, cv::NORM_INF), 0.0);
}

TEST(Workshop, WithoutAnyEffectIsProfile1) {
  Scene none = block(small(choose_effects("workshop", kAllFamilies, "").value())), first = block(small({}));
  const View a = none.look(0, 0.3), b = first.look(0, 0.3);
  EXPECT_EQ(cv::norm(a.left_pattern, b.left_pattern, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(a.right_plain, b.right_plain, cv::NORM_INF), 0.0);
}

TEST(Lamp, FallsOffToTheCornersAndLeavesTheDark) {
  const DotPattern dots(0.5);
  const Eye projector = default_rig().projector;
  const Lamp lamp(projector, dots, alone({"falloff", "contrast", "rounding"}), 0.0), even(projector, dots, {}, 0.0);
  const auto mean = [](const Lamp& l, double u, double v) { return l.mean_irradiance({u, v, 640.0, 1.0}, 1.0); };
  EXPECT_NEAR(mean(lamp, 1.0, 1.0) / mean(lamp, 959.5, 539.5), 0.7, 0.002);
  EXPECT_NEAR(mean(even, 1.0, 1.0) / mean(even, 959.5, 539.5), 1.0, 1e-12);
  double lowest = 1e9, highest = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const int column = i % 80, row = i / 80;
    const double light = lamp.irradiance({900.0 + column, 500.0 + row, 640.0, 0.7}, 1.0);
    lowest = std::min(lowest, light), highest = std::max(highest, light);
  }
  EXPECT_NEAR(highest / lowest, 60.0, 2.0);
  EXPECT_NEAR(
      std::pow(lamp.beam({0.0, 45.0, 0.0}, 0.0).sigma, 2.0) - std::pow(even.beam({0.0, 45.0, 0.0}, 0.0).sigma, 2.0),
      0.09, 1e-9);
}

TEST(Lights, VaryFromExposureToExposure) {
  const auto spread = [](const Scene& scene, const View& view, bool pattern) {
    double sum = 0.0, squares = 0.0;
    constexpr int kExposures = 150;
    for (int i = 1; i <= kExposures; ++i) {
      const double mean = cv::mean(scene.expose(view, pattern, i).left(cv::Rect(60, 58, 8, 8)))[0];
      sum += mean, squares += mean * mean;
    }
    return std::sqrt(std::max(0.0, squares / kExposures - std::pow(sum / kExposures, 2.0))) / (sum / kExposures);
  };
  Scene scene = block(small(alone({"flash", "flicker"}), 0.1));
  const View view = scene.look(0, 0.0);
  EXPECT_NEAR(spread(scene, view, true), 0.03, 0.006);
  EXPECT_NEAR(spread(scene, view, false), 0.02, 0.004);
  Scene still = block(small({}, 0.1));
  EXPECT_LT(spread(still, still.look(0, 0.0), true), 1e-6);
}

TEST(Lights, OfABrightRoomLeaveFaintDots) {
  Scene scene = block(small(alone({"faint-dots"}), 0.25)), dark = block(small({}, 0.25));
  const auto dots_of = [](Scene& of) {
    cv::Scalar mean, sigma;
    const cv::Mat image = of.shoot(0, 0.0, true, 1).left;
    cv::Mat green;  // one colour of the filters
    cv::resize(image(cv::Rect(146, 146, 28, 28)), green, {14, 14}, 0, 0, cv::INTER_NEAREST);
    cv::meanStdDev(green, mean, sigma);
    return std::pair(mean[0], sigma[0] / mean[0]);
  };
  const auto [level, contrast] = dots_of(scene);
  const auto [dark_level, dark_contrast] = dots_of(dark);
  EXPECT_LT(contrast, 0.35 * dark_contrast);
  EXPECT_LT(level, 200.0);
  EXPECT_EQ(cv::norm(scene.shoot(0, 0.0, false, 2).left, dark.shoot(0, 0.0, false, 2).left, cv::NORM_INF), 0.0);
}

TEST(Interreflection, AtTheFootOfAWallIsHalfOfWhatTheTableSends) {
  // A wall sees the table over half of its hemisphere, so at its foot takes half of the table's radiosity.
  TriangleMesh wall;
  constexpr int kAcross = 41, kUp = 21;
  for (int j = 0; j < kUp; ++j)
    for (int i = 0; i < kAcross; ++i) wall.vertices.push_back({2.0 * (i - 20), 0.5 + 2.0 * j, 0.0});
  for (int j = 0; j + 1 < kUp; ++j) {
    for (int i = 0; i + 1 < kAcross; ++i) {
      const int a = j * kAcross + i;
      wall.triangles.push_back({a, a + 1, a + kAcross});
      wall.triangles.push_back({a + 1, a + kAcross + 1, a + kAcross});
    }
  }
  const Object object = grey(wall, 0.5F);
  const RayCaster rays(object.mesh);
  const RigGeometry rig = default_rig();
  const DotPattern dots(0.25);
  const Lamp lamp(rig.projector, dots, {}, 0.0);
  const BouncePaths paths(object, rays, Transform::Identity());
  const BounceLight bounce(paths, object, rays, lamp, Transform::Identity());
  const Vector3d before(0.0, 0.0, 4.0), to_lamp = (rig.projector.centre() - before).normalized();
  const double arrives = lamp.mean_irradiance(lamp.beam(before, 1.0), to_lamp.y());
  const Vector3f &at_foot = bounce.at_vertex(20), &higher = bounce.at_vertex(18 * kAcross + 20);
  const Vector3f expected = static_cast<float>(0.5 * arrives) * rgb(profile().table_albedo);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(at_foot[c] / expected[c], 1.0, 0.12) << c;
  EXPECT_LT(higher.z(), 0.8F * at_foot.z());
  // And the table takes the wall's light: more before it than far from it, and grey.
  const Vector3f near_wall = bounce.on_table(0.0, 5.0), far = bounce.on_table(0.0, 70.0);
  EXPECT_GT(near_wall.x(), 3.0F * far.x());
  EXPECT_NEAR(near_wall.x(), near_wall.z(), 1e-6);
}

TEST(Interreflection, BrightensTheRenderedPattern) {
  Scene with = block(small(alone({"interreflection"}))), without = block(small({}));
  const cv::Mat more = with.look(0, 0.3).left_pattern - without.look(0, 0.3).left_pattern;
  double least = 0.0, most = 0.0;
  cv::minMaxLoc(more, &least, &most);
  EXPECT_GT(most, 0.01);
  EXPECT_GT(least, -1e-6);
}

TEST(TableTop, MirrorsTheObject) {
  Scene with = block(small(alone({"table-gloss"}), 0.5)), without = block(small({}, 0.5));
  const Eye& eye = with.rig().left;
  const cv::Mat mirror = with.look(0, 0.0).left_plain, flat = without.look(0, 0.0).left_plain;
  // The mirror image of a point of the front is as far below the table; that of the object hides the screen's.
  const Vector3d front(0.0, 15.0, 20.0), below(0.0, -15.0, 20.0);
  const cv::Vec3f more = at(mirror, eye, below) - at(flat, eye, below), face = at(flat, eye, front);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(more[c], 0.03F * face[c], 0.15F * 0.03F * face[c]) << c;
  const cv::Vec3f beside = at(mirror, eye, {-60.0, -15.0, 20.0}) - at(flat, eye, {-60.0, -15.0, 20.0});
  EXPECT_GT(beside[2], 2.0F * beside[0]);  // of the screen
}

TEST(Gloss, AddsLightOnEverySlopeOfASphere) {
  SceneOptions options = small(alone({"gloss"}), 0.5);
  options.object = "sphere", options.poses = 1;
  for (const char* material : {"matt", "satin", "gloss"}) {
    options.profile.material = material;
    const View with = Scene::create(options).value()->look(0, 0.0);
    options.profile.effects = {};
    const View without = Scene::create(options).value()->look(0, 0.0);
    options.profile.effects = alone({"gloss"});
    double least = 0.0;
    cv::minMaxLoc(with.left_plain - without.left_plain, &least);
    EXPECT_GE(least, -1e-5) << material;
  }
}

TEST(Screen, HasFoldsAndTheObjectsShadow) {
  const Object object = grey(box({40.0, 40.0, 5.0}), 0.6F);
  const RayCaster rays(object.mesh);
  const Backdrop backdrop;
  // Right before the screen's middle.
  const Transform placed(Eigen::Translation3d(backdrop.point + 15.0 * backdrop.normal));
  const RoomLight light(object, rays, placed);
  const ScreenLight folded(alone({"folds"}), object, rays, light, placed),
      shadowed(alone({"screen-shadow"}), object, rays, light, placed);
  double lowest = 2.0, highest = 0.0;
  for (int i = 0; i < 10000; ++i) {
    const int column = i % 100, row = i / 100;
    const double fold = folded.fold(backdrop.point + Vector3d(2.0 * column - 100.0, 2.0 * row - 100.0, 0.0));
    lowest = std::min(lowest, fold), highest = std::max(highest, fold);
  }
  EXPECT_NEAR(lowest, 0.7, 0.03);
  EXPECT_NEAR(highest, 1.1, 0.03);
  EXPECT_EQ(shadowed.fold(backdrop.point), 1.0);
  EXPECT_LT(shadowed.at(backdrop.point).factor, 0.3F);
  EXPECT_NEAR(shadowed.at(backdrop.point + Vector3d(220.0, 0.0, 0.0)).factor, 1.0, 0.03);
  const Vector3f colour = shadowed.at(backdrop.point + Vector3d(50.0, 0.0, 0.0)).colour;
  EXPECT_GT(colour.x(), 0.005F);
}

TEST(Handling, SpoilsOneViewOnly) {
  const Effects handled = choose_effects("workshop", kAllFamilies, "handling").value();
  int spoilt = 0;
  for (int view = 0; view < 8; ++view) {
    const Handling handling = Handling::of_view(handled, 5, 8, 0, 45.0 * view + 0.01);
    if (handling.creep_mm == 0.0) continue;
    ++spoilt;
    EXPECT_NE(view, 0);
    const Transform moved = handling.moved(Transform::Identity());
    EXPECT_NEAR(moved.translation().norm(), 0.05, 1e-12);
    EXPECT_NEAR(to_degrees(rotation_angle(moved.linear())), 0.02, 1e-9);
    EXPECT_EQ(Handling::of_view(handled, 5, 8, 1, 45.0 * view).creep_mm, 0.0);
  }
  EXPECT_EQ(spoilt, 1);
}

TEST(Handling, ShowsInTheImagesOfItsView) {
  const auto shot = [](std::string_view what) {
    SceneOptions options = small(choose_effects("workshop", kAllFamilies, what).value());
    options.views = 2;  // so the second view it is
    Scene scene = block(options);
    return std::pair(scene.look(0, M_PI), scene.look(0, 0.0));
  };
  const auto clean = shot("");
  const auto differ = [&](std::string_view what, cv::Mat View::*image) {
    const auto [spoilt, other] = shot(what);
    EXPECT_LT(cv::norm(other.*image, clean.second.*image, cv::NORM_INF), 2e-5) << what;
    cv::Mat difference = spoilt.*image - clean.first.*image;
    return difference;
  };
  EXPECT_GT(cv::norm(differ("creep", &View::left_pattern), cv::NORM_INF), 0.003);
  EXPECT_GT(cv::norm(differ("rock", &View::left_pattern), cv::NORM_INF), 0.001);
  EXPECT_LT(cv::mean(differ("finger", &View::left_pattern))[0], -0.002);
  EXPECT_LT(cv::norm(differ("finger", &View::left_plain), cv::NORM_INF), 1e-6);
  EXPECT_NEAR(cv::mean(differ("overexposed", &View::left_plain))[0] / cv::mean(clean.first.left_plain)[0], 1.5, 0.01);
  for (const std::string_view what : {"sticker", "shadow"}) {
    const cv::Mat less = differ(what, &View::left_plain);
    int darker = 0;  // of the red pixels: the screen has little of it
    for (int y = 0; y < less.rows; y += 2)
      for (int x = 0; x < less.cols; x += 2) darker += less.at<float>(y, x) < -0.1F ? 1 : 0;
    EXPECT_GT(darker, 20) << what;
    EXPECT_LT(darker, 400) << what;
  }
}

TEST(Warming, ChangesTheViewOfAColdRigOnly) {
  SceneOptions options = small(alone({"drift"}));
  Scene warm = block(options);
  options.profile.is_cold = true;
  Scene cold = block(options);
  const cv::Mat at_once = cold.look(0, 0.2, 0.0).left_pattern, later = cold.look(0, 0.2, 60.0).left_pattern;
  EXPECT_GT(cv::norm(at_once, later, cv::NORM_INF), 0.002);
  EXPECT_LT(cv::norm(later, warm.look(0, 0.2, 0.0).left_pattern, cv::NORM_INF), 0.002);
}

}  // namespace
}  // namespace scanrig::sim
