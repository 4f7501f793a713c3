#include "sim/scene/materials.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "core/units.h"
#include "sim/scene/renderer.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

Effects materials_only() {
  return choose_effects("workshop", "optics,sensor,projector,turntable,drift,room", "").value();
}

/// Sum of `f` over the directions of a hemisphere.
template <class F>
double over_hemisphere(const F& f) {
  constexpr int kRings = 2000, kSectors = 180;
  double sum = 0.0;
  for (int i = 0; i < kRings; ++i) {
    const double angle = 0.5 * M_PI * (i + 0.5) / kRings, width = 0.5 * M_PI / kRings;
    for (int j = 0; j < kSectors; ++j) {
      const double phi = 2.0 * M_PI * (j + 0.5) / kSectors;
      const Vector3d way(std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), std::cos(angle));
      sum += f(way) * std::sin(angle) * width * 2.0 * M_PI / kSectors;
    }
  }
  return sum;
}

TEST(Gloss, HasFacetsThatCoverTheSurfaceOnce) {
  for (const double alpha : {0.04, 0.2, 0.7})
    EXPECT_NEAR(over_hemisphere([&](const Vector3d& h) { return ggx_density(alpha, h.z()) * h.z(); }), 1.0, 0.002);
}

TEST(Gloss, MirrorsNoMoreLightThanArrives) {
  const Vector3d normal = Vector3d::UnitZ();
  for (const double cosine : {1.0, 0.7, 0.4}) {
    const Vector3d to_eye(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    const auto mirrored = [&](const Gloss& gloss) {
      return over_hemisphere([&](const Vector3d& l) { return gloss.towards(normal, to_eye, l) * l.z() / M_PI; });
    };
    const double of_mirror = mirrored({0.2, 1.0}), of_varnish = mirrored({0.2, 0.04});
    EXPECT_LT(of_mirror, 1.0);
    EXPECT_GT(of_mirror, 0.85);  // the rest is light that facets hide, which this model loses
    EXPECT_GT(of_varnish, 0.035);
    EXPECT_LT(of_varnish, 0.14);
    EXPECT_NEAR(mirrored(Gloss{0.2, 0.04}.widened(0.3)), of_varnish, 0.2 * of_varnish);
  }
}

TEST(Gloss, IsTheSameBothWays) {
  const Gloss gloss{0.2, 0.04};
  const Vector3d a = Vector3d(0.3, 0.1, 0.8).normalized(), b = Vector3d(-0.5, 0.2, 0.6).normalized();
  EXPECT_NEAR(gloss.towards(Vector3d::UnitZ(), a, b), gloss.towards(Vector3d::UnitZ(), b, a), 1e-12);
  EXPECT_EQ(gloss.towards(Vector3d::UnitZ(), a, -b), 0.0);
}

/// A ball of one material at the aim point, as the left camera sees it.
struct Ball {
  static constexpr double kRadius = 20.0;
  Object object;
  Transform placed{Eigen::Translation3d(0.0, 45.0, 0.0)};
  RigGeometry rig = default_rig(0.5);
  DotPattern dots{0.5};

  explicit Ball(const std::string& material, const Effects& effects = materials_only()) {
    TriangleMesh mesh;
    constexpr int kAround = 160, kDown = 80;
    for (int j = 0; j <= kDown; ++j) {
      for (int i = 0; i < kAround; ++i) {
        const double phi = 2.0 * M_PI * i / kAround, theta = M_PI * (j + 0.02) / (kDown + 0.04);
        mesh.vertices.push_back(
            kRadius * Vector3d(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)));
      }
    }
    for (int j = 0; j < kDown; ++j) {
      for (int i = 0; i < kAround; ++i) {
        const int a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
        mesh.triangles.push_back({a, a + kAround, b});
        mesh.triangles.push_back({b, a + kAround, b + kAround});
      }
    }
    object = grey(mesh, 0.5F);
    object.materials = Materials::named(material, effects).value();
    object.colour = object.materials.coloured(object.colour);
  }
  [[nodiscard]] Radiance look() const {
    const RayCaster rays(object.mesh);
    const RoomLight light(object, rays, placed);
    return render({object, rays, light, placed}, rig.left, rig.projector, dots, 0.0);
  }
};

TEST(Gloss, ShinesWhereTheNormalHalvesTheAngleOfLampAndCamera) {
  const Ball glossy("gloss"), matt("matt", {});
  const cv::Mat with = glossy.look().pattern, without = matt.look().pattern;
  const Vector3d centre(0.0, 45.0, 0.0);
  const Vector3d half =
      ((glossy.rig.left.centre() - centre).normalized() + (glossy.rig.projector.centre() - centre).normalized())
          .normalized();
  const Vector2d expected = glossy.rig.left.project(centre + Ball::kRadius * half);
  double sum = 0.0, elsewhere = 0.0;
  Vector2d seen = Vector2d::Zero();
  for (int y = 0; y < with.rows; ++y) {
    for (int x = 0; x < with.cols; ++x) {
      const double light = with.at<cv::Vec3f>(y, x)[1] - without.at<cv::Vec3f>(y, x)[1];
      const bool is_near = (Vector2d(x, y) - expected).norm() < 20.0;
      if (is_near && light > 0.2) sum += light, seen += light * Vector2d(x, y);
      if (!is_near) elsewhere = std::max(elsewhere, light);
    }
  }
  EXPECT_LT((seen / sum - expected).norm(), 2.5);
  EXPECT_GT(sum, 10.0);
  EXPECT_LT(elsewhere, 0.1);
}

TEST(Gloss, OfRoughSurfacesIsWiderAndFainter) {
  double highest[2] = {}, wide[2] = {};
  const cv::Mat matt = Ball("matt", {}).look().pattern;
  for (const int i : {0, 1}) {
    const cv::Mat lobe = Ball(i == 0 ? "gloss" : "satin").look().pattern - matt;
    cv::Mat green;
    cv::extractChannel(lobe, green, 1);
    cv::minMaxLoc(green, nullptr, &highest[i]);
    wide[i] = cv::countNonZero(green > 0.2 * highest[i]);
  }
  EXPECT_GT(highest[0], 3.0 * highest[1]);
  EXPECT_GT(wide[1], 3.0 * wide[0]);
}

TEST(Translucency, HalvesTheContrastOfDots) {
  const auto contrast = [](const Radiance& light) {
    // The middle of the ball, by the plain image's shading.
    cv::Mat ratio;
    cv::divide(light.pattern(cv::Rect(300, 220, 40, 40)), light.plain(cv::Rect(300, 220, 40, 40)), ratio);
    cv::Scalar mean, sigma;
    cv::meanStdDev(ratio, mean, sigma);
    return sigma[1] / mean[1];
  };
  const Effects no_gloss = choose_effects("2", "gloss", "").value();
  const double wax = contrast(Ball("translucent", no_gloss).look()), paint = contrast(Ball("matt", no_gloss).look());
  EXPECT_GT(wax / paint, 0.4);
  EXPECT_LT(wax / paint, 0.6);
  const Effects neither = choose_effects("2", "gloss,translucency", "").value();
  EXPECT_EQ(contrast(Ball("translucent", neither).look()), paint);
}

TEST(Materials, HaveTheirAlbedos) {
  const auto albedos = [](const std::string& name) {
    const Materials materials = Materials::named(name, materials_only()).value();
    const auto colour = materials.coloured(stone_colour());
    std::vector<Vector3f> seen;
    for (int i = 0; i < 400; ++i) {
      const int column = i % 20, row = i / 20;
      seen.push_back(colour->albedo({Vector3d(column * 6.0, row * 6.0, 3.0), 0, 0.0, 0.0, 0.3}));
    }
    return seen;
  };
  for (const auto& c : albedos("dark")) EXPECT_LT(c.maxCoeff(), 0.08F);
  int dark = 0, bright = 0, blue = 0;
  for (const auto& c : albedos("two-tone")) {
    EXPECT_TRUE(std::abs(c.maxCoeff() - 0.05F) < 1e-3F || std::abs(c.maxCoeff() - 0.8F) < 1e-3F);
    (c.maxCoeff() < 0.1F ? dark : bright) += 1;
  }
  EXPECT_GT(dark, 80);
  EXPECT_GT(bright, 80);
  for (const auto& c : albedos("screen-blue")) blue += c.isApprox(rgb(profile().backdrop_albedo)) ? 1 : 0;
  EXPECT_GT(blue, 80);
  EXPECT_LT(blue, 320);
}

TEST(Materials, JoinedByPlusLieInPatches) {
  const Materials materials = Materials::named("satin+gloss", materials_only()).value();
  int glossy = 0;
  for (int i = 0; i < 400; ++i) {
    const int column = i % 20, row = i / 20;
    glossy += materials.at({column * 6.0, row * 6.0, 3.0}).roughness < 0.3 ? 1 : 0;
  }
  EXPECT_GT(glossy, 80);
  EXPECT_LT(glossy, 320);
}

}  // namespace
}  // namespace scanrig::sim
