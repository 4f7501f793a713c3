#include "pipeline/pose/place_views.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <random>
#include <string>

#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig {
namespace {

using testing::ball;
using testing::block;
using testing::camera_from_turntable;
using testing::RigModel;
using testing::see;
using testing::Solid;
using testing::together;
using testing::workpiece;

const RigModel kCoarseRig{.width = 224, .height = 168, .focal_px = 800, .noise_mm = 0.02};

/// Views of an object, each in a frame of its own.
struct UnknownViews {
  std::vector<View> views;
  std::vector<Transform> own_from_model;
};

Transform unknown_place(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto next = [&] { return normal(random); };
  const Eigen::Vector4d q(next(), next(), next(), next());
  Transform t = Transform::Identity();
  t.linear() = Eigen::Quaterniond(q.normalized()).toRotationMatrix();
  t.translation() = 200.0 * Eigen::Vector3d(next(), next(), next());
  return t;
}

void add_unknown_view(const Solid& solid, const Transform& camera_from_model, double scale, std::mt19937& random,
                      UnknownViews& all) {
  View& view = all.views.emplace_back();
  view.index = static_cast<int>(all.views.size()) - 1;
  view.range = see(solid, camera_from_model, kCoarseRig, static_cast<unsigned>(all.views.size()));
  view.range.depth *= scale;
  view.range.sigma *= scale;
  const Transform own_from_model = unknown_place(random);
  view.range.camera_from_pose.translation() *= scale;
  view.range.camera_from_pose = view.range.camera_from_pose * own_from_model.inverse();
  all.own_from_model.push_back(own_from_model);
}

/// From around and one from higher up, `count` of them; `scale`: the object is so many times as large.
UnknownViews views_of(const Solid& solid, double scale, unsigned seed, int count = 9) {
  std::mt19937 random(seed);
  UnknownViews all;
  RigModel high = kCoarseRig;
  high.elevation_deg = 60.0;
  add_unknown_view(solid, camera_from_turntable(high) * rot_y(to_radians(20.0)), scale, random, all);
  for (int k = 0; k + 1 < count; ++k) {
    add_unknown_view(solid, camera_from_turntable(kCoarseRig) * rot_y(to_radians(45.0 * k)), scale, random, all);
  }
  return all;
}

/// A body with features all around, none of them twice.
Solid lumpy_figure() {
  return together({ball({0, 30, 0}, 24), ball({20, 48, 6}, 11), ball({-12, 52, 14}, 9), ball({4, 36, -24}, 8),
                   ball({-22, 22, -8}, 10), block({-16, 0, -14}, {18, 12, 16}), block({10, 8, 10}, {30, 20, 22})});
}

/// Errors of the placed views against the truth, over every two; at most `max_left_out` are missing.
void expect_views_in_place(const UnknownViews& truth, const PlacedViews& placed, double scale, double max_deg,
                           double max_mm, int max_left_out = 0) {
  const Eigen::Vector3d middle(0, 30 * scale, 0);
  std::vector<Transform> model_from_truth;
  for (std::size_t v = 0; v < truth.own_from_model.size(); ++v) {
    if (placed.model_from_view[v]) model_from_truth.push_back(*placed.model_from_view[v] * truth.own_from_model[v]);
  }
  EXPECT_GE(model_from_truth.size() + static_cast<std::size_t>(max_left_out), truth.own_from_model.size());
  for (const Transform& a : model_from_truth) {
    for (const Transform& b : model_from_truth) {
      const Transform error = a.inverse() * b;
      EXPECT_LT(to_degrees(rotation_angle(error.linear())), max_deg);
      EXPECT_LT((error * middle - middle).norm(), max_mm * scale);
    }
  }
}

TEST(PlaceViews, ViewsOfAFigureAreFoundWithoutAnyHint) {
  const UnknownViews truth = views_of(lumpy_figure(), 1.0, 1);
  const auto placed = place_views(truth.views, {}, {});
  ASSERT_TRUE(placed) << placed.error().message;
  expect_views_in_place(truth, *placed, 1.0, 0.2, 0.15);
  EXPECT_TRUE(placed->model_from_view[0]->isApprox(Transform::Identity()));
  EXPECT_GE(placed->links.size(), truth.views.size());
  EXPECT_LT(placed->median_mm, 0.05);
}

// Its flat faces slide along each other: what nothing holds may be left out, but not be placed wrongly.
TEST(PlaceViews, NoViewOfAWorkpieceWithFlatFacesIsPlacedWrongly) {
  const UnknownViews truth = views_of(workpiece(), 1.0, 2);
  const auto placed = place_views(truth.views, {}, {});
  ASSERT_TRUE(placed) << placed.error().message;
  expect_views_in_place(truth, *placed, 1.0, 0.2, 0.1, 1);
}

// No limit is a number of millimetres.
TEST(PlaceViews, AnObjectOfTwelveTimesTheSizeIsPlacedAlike) {
  const UnknownViews truth = views_of(lumpy_figure(), 12.0, 3, 4);
  const auto placed = place_views(truth.views, {}, {});
  ASSERT_TRUE(placed) << placed.error().message;
  expect_views_in_place(truth, *placed, 12.0, 0.2, 0.15);
}

TEST(PlaceViews, AViewOfAnotherObjectIsLeftOut) {
  UnknownViews truth = views_of(lumpy_figure(), 1.0, 4, 5);
  std::mt19937 random(9);
  UnknownViews other;
  add_unknown_view(workpiece(), camera_from_turntable(kCoarseRig) * rot_y(1.0), 1.0, random, other);
  truth.views.insert(truth.views.begin() + 3, other.views.front());
  auto placed = place_views(truth.views, {}, {});
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_FALSE(placed->model_from_view[3]);
  placed->model_from_view.erase(placed->model_from_view.begin() + 3);
  expect_views_in_place(truth, *placed, 1.0, 0.2, 0.15);
}

TEST(PlaceViews, ViewsOfABallFitInEveryWayAndAreLeftOut) {
  std::mt19937 random(5);
  UnknownViews truth;
  for (const double angle : {0.0, 30.0, 60.0}) {
    add_unknown_view(ball({0, 30, 0}, 30), camera_from_turntable(kCoarseRig) * rot_y(to_radians(angle)), 1.0, random,
                     truth);
  }
  const auto placed = place_views(truth.views, {}, {});
  ASSERT_TRUE(placed) << placed.error().message;
  for (const auto& model_from_view : placed->model_from_view) EXPECT_FALSE(model_from_view);
}

TEST(PlaceViews, ViewsWithoutCommonSurfaceAreAllLeftOut) {
  std::mt19937 random(6);
  UnknownViews truth;
  add_unknown_view(lumpy_figure(), camera_from_turntable(kCoarseRig), 1.0, random, truth);
  add_unknown_view(workpiece(), camera_from_turntable(kCoarseRig) * rot_y(2.5), 1.0, random, truth);
  const auto placed = place_views(truth.views, {}, {});
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_FALSE(placed->model_from_view[0]);
  EXPECT_FALSE(placed->model_from_view[1]);
}

TEST(PlaceViews, TheNumberOfThreadsChangesNoBit) {
  const UnknownViews truth = views_of(lumpy_figure(), 1.0, 7, 4);
  std::vector<PlacedViews> placed;
  for (const int threads : {1, 2, 5}) {
    with_threads(threads, [&] { placed.push_back(place_views(truth.views, {}, {}).value()); });
    ASSERT_EQ(placed.back().model_from_view.size(), 4U);
    for (std::size_t v = 0; v < 4; ++v) {
      ASSERT_TRUE(placed.back().model_from_view[v]);
      EXPECT_EQ(placed.back().model_from_view[v]->matrix(), placed.front().model_from_view[v]->matrix());
    }
  }
}

TEST(PlaceViews, RefusesOneViewAndViewsWithoutSurface) {
  UnknownViews truth = views_of(lumpy_figure(), 1.0, 8, 1);
  EXPECT_EQ(place_views(truth.views, {}, {}).error().code, ErrorCode::invalid_input);
  truth.views.push_back(truth.views.front());
  truth.views.back().range.depth = cv::Mat1f(truth.views.back().range.depth.size(), kUnmeasured);
  EXPECT_EQ(place_views(truth.views, {}, {}).error().code, ErrorCode::invalid_input);
}

TEST(PlaceViews, StopsOnRequest) {
  const UnknownViews truth = views_of(lumpy_figure(), 1.0, 8, 2);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(place_views(truth.views, {}, {stop.get_token(), {}}).error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
