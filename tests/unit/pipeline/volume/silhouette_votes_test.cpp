#include "pipeline/volume/silhouette_votes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/range/crop_view.h"
#include "pipeline/silhouette/contour_distance.h"
#include "pipeline/volume/integrate.h"
#include "tests/unit/pipeline/volume/analytic_rig.h"

namespace scanrig {
namespace {

using namespace test;
using Kind = SilhouetteFinding::Kind;

/// Copies of a view share their pixels; these do not.
std::vector<View> with_own_pixels(std::vector<View> views) {
  for (View& view : views) {
    for (Silhouette& s : view.silhouettes) s.outside_px = s.outside_px.clone();
    view.range.background = view.range.background.clone();
    view.range.depth = view.range.depth.clone();
    view.range.sigma = view.range.sigma.clone();
    view.range.normal = view.range.normal.clone();
  }
  return views;
}

/// A block with a round hole through it, seen by all cameras around.
std::vector<View> pierced_block() {
  static const auto taken =
      take_views({.views = 12}, cast_into(carve(box({-20, 0, -8}, {20, 40, 8}), rod({0, 20, -20}, {0, 20, 20}, 7))));
  return with_own_pixels(taken);
}

const Solid& voted_ball() {
  static const Solid solid = sphere({0, 30, 0}, 25);
  return solid;
}

std::vector<View> seen_ball() {
  static const auto taken = take_views({}, cast_into(voted_ball()));
  return with_own_pixels(taken);
}

/// As a sticker of the screen's colour does: the silhouette has an opening there, and what is in it was not matched.
void put_sticker(View& view, std::size_t camera, const cv::Point& centre, int radius) {
  cv::Mat1f& outside = view.silhouettes[camera].outside_px;
  cv::Mat1b sticker(outside.size(), uchar{0});
  cv::circle(sticker, centre, radius, 255, cv::FILLED);
  outside.setTo(0.5F, sticker);
  outside = contour_distance(outside);
  if (camera != 0) return;
  view.range.background.setTo(255, sticker);
  view.range.depth.setTo(kUnmeasured, sticker);
  view.range.sigma.setTo(kUnmeasured, sticker);
  view.range.normal.setTo(cv::Vec3f::all(kUnmeasured), sticker);
}

/// As of a dark object, whose rim mirrors the screen: the outline is inside of the true one.
void shrink(View& view, std::size_t camera, float by_px) {
  cv::Mat1f& outside = view.silhouettes[camera].outside_px;
  outside += by_px;
  if (camera == 0) view.range.background.setTo(255, outside > 0.0F);
}

/// As a crease that mirrors the screen does: too narrow for a pixel that is surely outside.
void put_crease(View& view, std::size_t camera, const cv::Point& from, const cv::Point& to) {
  cv::Mat1f& outside = view.silhouettes[camera].outside_px;
  cv::Mat1b crease(outside.size(), uchar{0});
  cv::line(crease, from, to, 255, 3);
  outside.setTo(0.5F, crease);
  outside = contour_distance(outside);
}

/// Where a camera of the view sees a point.
cv::Point seen_at(const View& view, std::size_t camera, const Eigen::Vector3d& point) {
  const Silhouette& s = view.silhouettes[camera];
  const Eigen::Vector2d at = s.projection.project(s.camera_from_pose * point);
  return {static_cast<int>(at.x()), static_cast<int>(at.y())};
}

std::vector<SilhouetteFinding> vote(std::vector<View>& views) {
  const auto verdict = vote_on_silhouettes(views, {}, {});
  EXPECT_TRUE(verdict) << verdict.error().message;
  EXPECT_LT(verdict ? verdict->disputed_share : 1.0, 0.05);
  return verdict ? verdict->findings : std::vector<SilhouetteFinding>();
}

double greatest_error(const std::vector<View>& views) {
  const PosedViews pose{views};
  const auto surface = integrate({&pose, 1}, {.voxel_mm = 0.5});
  EXPECT_TRUE(surface);
  return surface
             ? accuracy(surface->mesh, voted_ball()).greatest + accuracy(surface->mesh, voted_ball()).greatest_closed
             : 1e9;
}

std::size_t measured_vertices(const std::vector<View>& views) {
  const PosedViews pose{views};
  const auto surface = integrate({&pose, 1}, {.voxel_mm = 0.5});
  EXPECT_TRUE(surface);
  return surface ? surface->report.measured_vertices : 0;
}

TEST(SilhouetteVotes, SoundSilhouettesStayAsTheyAre) {
  for (auto views : {seen_ball(), pierced_block()}) {
    const auto before = views;
    EXPECT_TRUE(vote(views).empty());
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t c = 0; c < 2; ++c) {
        EXPECT_EQ(cv::countNonZero(views[v].silhouettes[c].outside_px != before[v].silhouettes[c].outside_px), 0);
      }
      EXPECT_EQ(cv::countNonZero(views[v].range.background != before[v].range.background), 0);
    }
  }
}

/// The ball with an arm. To the left camera of view 0 it seems to have none: there the image is cropped to the ball.
std::vector<View> with_a_lost_arm(bool cropped) {
  static const auto taken = take_views({.views = 12}, cast_into(join({voted_ball(), rod({0, 30, 0}, {56, 30, 0}, 6)})));
  auto views = with_own_pixels(taken);
  cv::Mat1f& outside = views[0].silhouettes[0].outside_px;
  cv::Mat1b lost(outside.size(), uchar{0});
  cv::circle(lost, seen_at(views[0], 0, {0, 30, 0}), 70, 255, cv::FILLED);
  outside.setTo(5.0F, cv::Mat1b(lost == 0));
  outside = contour_distance(outside);
  views[0].range.background.setTo(255, outside > 0.0F);
  for (auto* image : {&views[0].range.depth, &views[0].range.sigma}) image->setTo(kUnmeasured, outside > 0.0F);
  views[0].range.normal.setTo(cv::Vec3f::all(kUnmeasured), outside > 0.0F);
  if (cropped) std::ranges::for_each(views, crop_to_object);
  return views;
}

TEST(SilhouetteVotes, WhatWasCroppedOffIsVotedOnAndComesBack) {
  for (const bool cropped : {false, true}) {
    auto views = with_a_lost_arm(cropped);
    const Eigen::Vector3d tip(54, 30, 0);
    const Silhouette& s = views[0].silhouettes[0];
    ASSERT_EQ(cropped, s.projection.is_cropped_off(s.projection.project(s.camera_from_pose * tip)));
    const auto findings = vote(views);
    ASSERT_EQ(findings.size(), 1U) << "cropped: " << cropped;
    EXPECT_EQ(findings[0].view, 0);
    EXPECT_EQ(findings[0].camera, 0U);
    const cv::Point at = seen_at(views[0], 0, tip);
    ASSERT_TRUE(at.inside({0, 0, s.outside_px.cols, s.outside_px.rows}));
    EXPECT_LT(s.outside_px(at), 0.0F);
    EXPECT_EQ(views[0].range.background(at), 0);
    EXPECT_EQ(views[0].range.depth.size(), s.outside_px.size());
  }
}

TEST(SilhouetteVotes, CroppedViewsMakeTheSameSurface) {
  auto views = seen_ball();
  const PosedViews pose{views};
  const auto whole = integrate({&pose, 1}, {.voxel_mm = 0.5});
  auto parts = seen_ball();
  std::ranges::for_each(parts, crop_to_object);
  const PosedViews cropped{parts};
  const auto surface = integrate({&cropped, 1}, {.voxel_mm = 0.5});
  ASSERT_TRUE(whole && surface);
  EXPECT_LT(3 * parts.front().range.depth.total(), 2 * views.front().range.depth.total());
  EXPECT_EQ(surface->mesh.faces, whole->mesh.faces);
  ASSERT_EQ(surface->mesh.vertices.size(), whole->mesh.vertices.size());
  float greatest = 0.0F;  // outlines are projected in single precision, from another corner
  for (std::size_t v = 0; v < whole->mesh.vertices.size(); ++v) {
    greatest = std::max(greatest, (surface->mesh.vertices[v] - whole->mesh.vertices[v]).norm());
  }
  EXPECT_LT(greatest, 1e-3F);
}

TEST(SilhouetteVotes, AStickerInOneSilhouetteDoesNotCutAHoleIntoMeasuredSurface) {
  const double sound = greatest_error(seen_ball());
  for (const std::size_t camera : {0U, 1U}) {
    auto views = seen_ball();
    put_sticker(views[3], camera, seen_at(views[3], camera, {0, 30, 0}), 18);
    const double spoilt = greatest_error(views);
    const auto findings = vote(views);
    ASSERT_EQ(findings.size(), 1U);
    EXPECT_EQ(findings[0].kind, Kind::region);
    EXPECT_EQ(findings[0].view, 3);
    EXPECT_EQ(findings[0].camera, camera);
    EXPECT_GE(findings[0].views, 2);
    EXPECT_NEAR(findings[0].area_px, 3.14 * 18 * 18, 150.0);  // the opening goes whole
    EXPECT_GT(spoilt, 5.0 * sound);
    EXPECT_LT(greatest_error(views), 1.5 * sound);
  }
}

TEST(SilhouetteVotes, ARimThatMirrorsTheScreenCutsNoMeasuredSurface) {
  const std::size_t sound = measured_vertices(seen_ball());
  auto views = seen_ball();
  for (View& view : views) {
    for (const std::size_t camera : {0U, 1U}) shrink(view, camera, 2.8F);
  }
  EXPECT_LT(measured_vertices(views), sound * 9 / 10) << sound;
  EXPECT_TRUE(vote(views).empty());
  EXPECT_GT(measured_vertices(views), sound * 97 / 100);
}

TEST(SilhouetteVotes, ANarrowOpeningThatSurfaceCoversIsClosedWithoutAWord) {
  const double sound = greatest_error(seen_ball());
  auto views = seen_ball();
  const cv::Point middle = seen_at(views[3], 1, {0, 30, 0});
  put_crease(views[3], 1, middle + cv::Point(-30, 10), middle + cv::Point(25, -15));
  EXPECT_GT(greatest_error(views), 3.0 * sound);
  EXPECT_TRUE(vote(views).empty());
  EXPECT_LT(greatest_error(views), 1.5 * sound);
}

TEST(SilhouetteVotes, ANarrowSlitThatViewsLookThroughStaysOpen) {
  const auto slit = carve(box({-20, 0, -4}, {20, 40, 4}), box({-1.2, 10, -20}, {1.2, 30, 20}));
  auto views = with_own_pixels(take_views({.views = 12}, cast_into(slit)));
  const auto before = views;
  EXPECT_TRUE(vote(views).empty());
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(cv::countNonZero(views[0].silhouettes[c].outside_px != before[0].silhouettes[c].outside_px), 0);
  }
}

TEST(SilhouetteVotes, APartThatIsJoinedToTheScreenDoesNotCarveEither) {
  const double sound = greatest_error(seen_ball());
  auto views = seen_ball();
  const cv::Point centre = seen_at(views[2], 0, {0, 30, 0});
  put_sticker(views[2], 0, {centre.x - 60, centre.y}, 25);  // the ball's limb is 62 px from its middle
  const auto findings = vote(views);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].kind, Kind::region);
  EXPECT_LT(greatest_error(views), 1.5 * sound);
}

TEST(SilhouetteVotes, ASilhouetteThatLosesMostOfTheObjectIsLeftOutWhole) {
  auto views = seen_ball();
  put_sticker(views[1], 1, seen_at(views[1], 1, {0, 30, 0}), 55);
  const auto findings = vote(views);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].kind, Kind::whole);
  EXPECT_GT(findings[0].share, 0.5);
  EXPECT_LT(cv::sum(views[1].silhouettes[1].outside_px > 0.0F)[0], 1.0);
}

TEST(SilhouetteVotes, SeveralSilhouettesAreRightAgainstAWronglyMeasuredSurface) {
  auto views = seen_ball();
  // Two views agree on a patch 12 mm outside of the ball: most silhouettes show screen there.
  const auto wrong = take_views({}, cast_into(join({voted_ball(), sphere({0, 62, 0}, 6)})));
  for (const std::size_t v : {0U, 1U}) {
    views[v].range = wrong[v].range;
  }
  const auto before = views;
  EXPECT_TRUE(vote(views).empty());
  for (std::size_t v = 0; v < views.size(); ++v) {
    EXPECT_EQ(cv::countNonZero(views[v].silhouettes[0].outside_px != before[v].silhouettes[0].outside_px), 0);
  }
}

TEST(SilhouetteVotes, AHoleThatViewsLookThroughStaysOpenBesideAMendedSilhouette) {
  auto views = pierced_block();
  put_sticker(views[0], 0, seen_at(views[0], 0, {14, 30, 8}), 9);
  ASSERT_EQ(vote(views).size(), 1U);
  const PosedViews pose{views};
  const auto surface = integrate({&pose, 1}, {.voxel_mm = 0.5});
  ASSERT_TRUE(surface);
  EXPECT_EQ(topology(surface->mesh).genus(), 1);
}

TEST(SilhouetteVotes, AShadowThatIsTakenForObjectIsNamedAndHarmless) {
  auto views = seen_ball();
  cv::Mat1f& outside = views[4].silhouettes[0].outside_px;
  const cv::Point centre = seen_at(views[4], 0, {0, 30, 0});
  cv::Mat1b shadow(outside.size(), uchar{0});
  cv::circle(shadow, {centre.x + 65, centre.y}, 25, 255, cv::FILLED);
  outside.setTo(-0.5F, shadow);
  outside = contour_distance(outside);
  const auto findings = vote(views);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].kind, Kind::surplus);
  EXPECT_EQ(findings[0].view, 4);
  EXPECT_EQ(findings[0].camera, 0U);
}

TEST(SilhouetteVotes, ManyPartsInTheScreensColourAreDisputedByManySilhouettes) {
  auto views = seen_ball();
  const Eigen::Vector3d middle(0, 30, 0);
  for (int patch = 0; patch < 24; ++patch) {
    const int column = patch / 2;
    const double azimuth = 2.0 * std::numbers::pi * column / 12.0, height = patch % 2 == 0 ? 0.1 : 0.6;
    const Eigen::Vector3d out(std::sqrt(1.0 - height * height) * std::sin(azimuth), height,
                              std::sqrt(1.0 - height * height) * std::cos(azimuth));
    for (View& view : views) {
      for (const std::size_t camera : {0U, 1U}) {
        const Eigen::Vector3d eye = view.silhouettes[camera].camera_from_pose.inverse().translation();
        const bool is_seen = out.dot((eye - middle).normalized()) > 0.2;
        if (is_seen) put_sticker(view, camera, seen_at(view, camera, middle + 25.0 * out), 14);
      }
    }
  }
  const auto verdict = vote_on_silhouettes(views, {}, {});
  ASSERT_TRUE(verdict);
  EXPECT_GT(verdict->disputed_share, 0.1);
}

TEST(SilhouetteVotes, GivesTheSameBitsForAnyNumberOfThreads) {
  std::vector<std::vector<View>> results;
  for (const int threads : {1, 3}) {
    auto views = seen_ball();
    put_sticker(views[3], 0, seen_at(views[3], 0, {0, 30, 0}), 18);
    with_threads(threads, [&] { vote(views); });
    results.push_back(std::move(views));
  }
  for (std::size_t v = 0; v < results[0].size(); ++v) {
    const cv::Mat1f &a = results[0][v].silhouettes[0].outside_px, &b = results[1][v].silhouettes[0].outside_px;
    EXPECT_EQ(std::memcmp(a.data, b.data, a.total() * sizeof(float)), 0);
  }
}

TEST(SilhouetteVotes, StopsWhenAsked) {
  auto views = seen_ball();
  std::stop_source stop;
  stop.request_stop();
  const auto findings = vote_on_silhouettes(views, {}, {stop.get_token(), {}});
  ASSERT_FALSE(findings);
  EXPECT_EQ(findings.error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
