#include "pipeline/volume/integrate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "core/max_poses.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/mesh/self_intersection.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/topology.h"
#include "tests/unit/pipeline/volume/analytic_rig.h"

namespace scanrig {
namespace {

using namespace test;
using Fusion = VolumeOptions::Fusion;

Result<Surface> integrate_views(const std::vector<View>& views, const VolumeOptions& options = {.voxel_mm = 0.5}) {
  const PosedViews pose{views};
  return integrate({&pose, 1}, options);
}

/// One closed component without self-contact, of the true genus.
void expect_closed(const Mesh& mesh, long genus) {
  const Topology shape = topology(mesh);
  EXPECT_TRUE(shape.watertight());
  EXPECT_EQ(shape.components, 1U);
  EXPECT_EQ(shape.genus(), genus);
  EXPECT_EQ(mesh.views.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.sigma.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.normals.size(), mesh.vertices.size());
}

double volume(const Mesh& mesh) { return solid_properties(mesh).value().volume_mm3; }

const Solid& ball() {
  static const Solid solid = sphere({0, 30, 0}, 25);
  return solid;
}
const std::vector<View>& ball_views() {
  static const auto views = take_views({}, cast_into(ball()));
  return views;
}

TEST(Integrate, NoiseFreeSphereIsClosedAndWithinFiveMicrometres) {
  const auto surface = integrate_views(ball_views());
  ASSERT_TRUE(surface) << surface.error().message;
  expect_closed(surface->mesh, 0);
  const Accuracy a = accuracy(surface->mesh, ball());
  EXPECT_LE(a.median, 0.005);
  EXPECT_LE(a.p95, 0.01);
  EXPECT_LE(a.greatest, 0.05);
  EXPECT_GT(a.measured_share, 0.7);
  EXPECT_EQ(surface->report.measured_vertices + surface->report.closed_vertices, surface->mesh.vertices.size());
}

TEST(Integrate, VerticesHaveTheNumberOfTheirViewsAndTheirSigma) {
  const auto surface = integrate_views(ball_views());
  ASSERT_TRUE(surface);
  for (std::size_t v = 0; v < surface->mesh.vertices.size(); ++v) {
    if (surface->mesh.views[v] == 0) {
      EXPECT_TRUE(std::isnan(surface->mesh.sigma[v]));
      const float y = surface->mesh.vertices[v].y();
      EXPECT_TRUE(y < 32.0F || y > 53.0F) << y;  // only the underside of a ball is hidden, and its top seen too flat
    } else {
      EXPECT_LE(surface->mesh.views[v], 8);
      EXPECT_GT(surface->mesh.sigma[v], 0.0F);
      EXPECT_LE(surface->mesh.sigma[v], 0.0101F);  // one view's
    }
  }
}

double median_sigma(const std::vector<View>& views) {
  const auto surface = integrate_views(views);
  EXPECT_TRUE(surface);
  std::vector<float> sigmas;
  for (std::size_t v = 0; surface && v < surface->mesh.vertices.size(); ++v) {
    if (surface->mesh.views[v] >= 3) sigmas.push_back(surface->mesh.sigma[v]);
  }
  std::sort(sigmas.begin(), sigmas.end());
  return sigmas.empty() ? 0.0 : static_cast<double>(sigmas[sigmas.size() / 2]);
}

TEST(Integrate, ViewsThatScatterMoreThanTheirSigmasSayWidenSigma) {
  auto views = take_views({}, cast_into(ball()));
  const double sound = median_sigma(views);
  for (std::size_t v = 0; v < views.size(); ++v) {
    cv::Mat1f& depth = views[v].range.depth;
    depth = depth + (v % 2 == 0 ? 0.04 : -0.04);
  }
  const double scattered = median_sigma(views);
  EXPECT_GT(scattered, 2.5 * sound);
  EXPECT_LT(scattered, 6.0 * sound);
  for (View& view : views) view.range.sigma = 10.0 * view.range.sigma;  // they say it
  EXPECT_NEAR(median_sigma(views), 10.0 * sound, 0.1 * sound);
}

/// Median sigma of a cube's vertices near its upright edges, over that of the middles of its sides.
double edge_over_side(const std::vector<View>& views) {
  const auto surface = integrate_views(views);
  EXPECT_TRUE(surface);
  std::vector<double> edge, side;
  for (std::size_t v = 0; surface && v < surface->mesh.vertices.size(); ++v) {
    const Eigen::Vector3f& p = surface->mesh.vertices[v];
    if (surface->mesh.views[v] < 2 || p.y() < 15.0F || p.y() > 25.0F) continue;
    const float inner = std::min(std::abs(p.x()), std::abs(p.z()));
    if (inner > 19.0F) edge.push_back(static_cast<double>(surface->mesh.sigma[v]));
    if (inner < 5.0F) side.push_back(static_cast<double>(surface->mesh.sigma[v]));
  }
  EXPECT_GT(edge.size(), 20U);
  EXPECT_GT(side.size(), 20U);
  return edge.empty() || side.empty() ? 0.0 : quantile(edge, 0.5) / quantile(side, 0.5);
}

TEST(Integrate, SigmaIsWiderWhereShapeIsFinerThanAWindow) {
  const Cast cube = cast_into(box({-20.0, 0.0, -20.0}, {20.0, 40.0, 20.0}));
  auto views = take_views({}, cube);
  const double by_pixel = edge_over_side(views);
  EXPECT_LT(by_pixel, 2.0);
  for (View& view : views) view.range.window_px = 5.0F;
  EXPECT_GT(edge_over_side(views), 3.0 * by_pixel);

  auto round = take_views({}, cast_into(ball()));
  const double sound = median_sigma(round);
  for (View& view : round) view.range.window_px = 5.0F;
  EXPECT_LT(median_sigma(round), 1.1 * sound) << "a quadratic follows a ball";
}

TEST(Integrate, NoFaceCrossesAnotherHoweverNoisyTheSheet) {
  const auto views = take_views({.noise_mm = 0.8}, cast_into(box({-20.0, 0.0, -0.3}, {20.0, 30.0, 0.3})));
  const auto crossing = [&](bool untangle) {
    const auto surface = integrate_views(views, {.voxel_mm = 0.5, .untangle = untangle});
    EXPECT_TRUE(surface);
    return self_intersecting_faces(surface->mesh).size();
  };
  EXPECT_GT(crossing(false), 10U) << "else this test shows nothing";
  EXPECT_EQ(crossing(true), 0U);
}

TEST(Integrate, NoiseIsAveragedAndDropoutsLeaveNoHoles) {
  const auto views = take_views({.noise_mm = 0.04, .dropouts = 0.05}, cast_into(ball()));
  const auto surface = integrate_views(views);
  ASSERT_TRUE(surface) << surface.error().message;
  expect_closed(surface->mesh, 0);
  const Accuracy a = accuracy(surface->mesh, ball());
  EXPECT_LE(a.median, 0.02);
  EXPECT_LE(a.p95, 0.06);
  EXPECT_LE(a.greatest, 0.25);
}

TEST(Integrate, HandleOfATorusSurvives) {
  const Solid ring = torus({0, 27, 0}, Eigen::Vector3d(0.3, 0.2, 1).normalized(), 18, 6);
  const auto surface = integrate_views(take_views({.noise_mm = 0.02}, cast_into(ring)));
  ASSERT_TRUE(surface) << surface.error().message;
  expect_closed(surface->mesh, 1);
  EXPECT_LE(accuracy(surface->mesh, ring).median, 0.01);
}

TEST(Integrate, OneMillimetreWallKeepsBothFacesInPlace) {
  Transform turn = Transform::Identity();
  turn.linear() = rot_y(0.4).linear();
  const Solid wall = moved(box({-10, 35, -0.5}, {10, 52, 0.5}), turn);
  const auto surface = integrate_views(take_views({.mm_per_pixel = 0.15}, cast_into(wall)), {.voxel_mm = 0.25});
  ASSERT_TRUE(surface) << surface.error().message;
  expect_closed(surface->mesh, 0);
  EXPECT_LE(accuracy(surface->mesh, wall).median, 0.005);
  EXPECT_NEAR(volume(surface->mesh), 20.0 * 17.0 * 1.0, 40.0);
}

TEST(Integrate, DeepPitBesideLegsAndAGapKeepsGenusZero) {
  const Solid body = carve(box({-18, 18, -12}, {18, 40, 12}), cylinder(0, 0, 24, 60, 6));
  const Solid solid = join({body, box({-18, 0, -12}, {-2, 20, 12}), box({2, 0, -12}, {18, 20, 12})});
  const auto views = take_views({.noise_mm = 0.03, .dropouts = 0.02}, cast_into(solid));
  const auto surface = integrate_views(views);
  ASSERT_TRUE(surface) << surface.error().message;
  expect_closed(surface->mesh, 0);
  EXPECT_LE(accuracy(surface->mesh, solid).p95, 0.1);
}

/// The paper's Figures 4 and 5: a hollow that only the second pose can see.
class Cup : public testing::Test {
 protected:
  static constexpr double kDepth = 5.0, kInner = 20.0;
  Cup() {
    turned_over_.linear() = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()).toRotationMatrix();
    turned_over_.translation() = Eigen::Vector3d(3, 25, -2);
    const Solid upside_down = carve(cylinder(0, 0, 0, 25, 24), cylinder(0, 0, -5, kDepth, kInner));
    solid_ = upside_down;
    first_ = take_views({}, cast_into(upside_down));
    second_ = take_views({}, cast_into(moved(upside_down, turned_over_)));
  }
  static void expect_same_bits(const Result<Surface>& a, const Result<Surface>& b) {
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->mesh.vertices.size(), b->mesh.vertices.size());
    ASSERT_EQ(a->mesh.sigma.size(), b->mesh.sigma.size());
    const auto are_same = [](const auto& x, const auto& y) {
      return std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
    };
    EXPECT_TRUE(are_same(a->mesh.vertices, b->mesh.vertices));
    EXPECT_TRUE(are_same(a->mesh.sigma, b->mesh.sigma));
    EXPECT_EQ(a->mesh.faces, b->mesh.faces);
    EXPECT_EQ(a->mesh.views, b->mesh.views);
  }

  Transform turned_over_ = Transform::Identity();  // pose 2 from pose 1
  Solid solid_;
  std::vector<View> first_, second_;
};

TEST_F(Cup, HollowUnseenInPoseOneIsOpenedByPoseTwoInBothModes) {
  const double hollow = std::numbers::pi * kInner * kInner * kDepth;
  const double filled = std::numbers::pi * 24 * 24 * 25;
  for (const auto fusion : {Fusion::evidence, Fusion::paper}) {
    const VolumeOptions options{.voxel_mm = 0.5, .fusion = fusion};
    const auto partial = integrate_views(first_, options);
    ASSERT_TRUE(partial) << partial.error().message;
    EXPECT_NEAR(volume(partial->mesh), filled, 0.02 * filled);

    const std::vector<PosedViews> poses = {{first_}, {second_, turned_over_.inverse()}};
    const auto whole = integrate(poses, options);
    ASSERT_TRUE(whole) << whole.error().message;
    EXPECT_TRUE(topology(whole->mesh).watertight());
    // The class table leaves some of the rim's inner wall closed; the evidence has all of it.
    EXPECT_NEAR(volume(whole->mesh), filled - hollow, (fusion == Fusion::evidence ? 0.05 : 0.35) * hollow);
    if (fusion == Fusion::evidence) expect_closed(whole->mesh, 0);
    EXPECT_LE(accuracy(whole->mesh, solid_).median, 0.005);

    std::size_t pairs = 0, classes = 0;
    for (const auto& row : whole->report.class_pairs) {
      for (const auto count : row) pairs += count;
    }
    for (const auto count : whole->report.class_counts.at(1)) classes += count;
    EXPECT_EQ(pairs, classes);
    EXPECT_GT(whole->report.class_pairs[0][0], 0U);  // overlap in both poses
  }
}

/// Pose 1 once more as a third one: nothing new is seen, and what was seen stays.
TEST_F(Cup, ThreePosesGiveTheSurfaceThatTwoGive) {
  const Transform back = turned_over_.inverse();
  const auto two = integrate(std::vector<PosedViews>{{first_}, {second_, back}}, {.voxel_mm = 0.8});
  const auto three = integrate(std::vector<PosedViews>{{first_}, {second_, back}, {first_}}, {.voxel_mm = 0.8});
  ASSERT_TRUE(two && three);
  expect_closed(three->mesh, 0);
  EXPECT_NEAR(volume(three->mesh), volume(two->mesh), 0.005 * volume(two->mesh));
  EXPECT_LE(accuracy(three->mesh, solid_).median, 0.005);
  ASSERT_EQ(three->report.class_counts.size(), 3U);
  EXPECT_EQ(three->report.class_counts[0], three->report.class_counts[2]);
}

TEST_F(Cup, SameBitsForAnyNumberOfThreads) {
  const std::vector<PosedViews> poses = {{first_}, {second_, turned_over_.inverse()}};
  Result<Surface> one = fail(ErrorCode::internal, ""), three = one;
  with_threads(1, [&] { one = integrate(poses, {.voxel_mm = 0.8}); });
  with_threads(3, [&] { three = integrate(poses, {.voxel_mm = 0.8}); });
  expect_same_bits(one, three);
}

TEST_F(Cup, SameBitsWithinAnyMemory) {
  const std::vector<PosedViews> poses = {{first_}, {second_, turned_over_.inverse()}};
  for (const auto fusion : {Fusion::evidence, Fusion::paper}) {
    const auto whole = integrate(poses, {.voxel_mm = 0.8, .fusion = fusion});
    const auto in_places =
        integrate(poses, {.voxel_mm = 0.8, .fusion = fusion, .memory_bytes = 1, .max_bricks_per_axis = 3});
    expect_same_bits(whole, in_places);
    EXPECT_EQ(whole->report.bricks, 1U);
    EXPECT_EQ(in_places->report.bricks, 27U);
    EXPECT_EQ(whole->report.class_pairs, in_places->report.class_pairs);
    EXPECT_EQ(whole->report.active_voxels, in_places->report.active_voxels);
  }
}

TEST_F(Cup, CompactRangeImagesGiveTheSameSurfaceAndTheSameBitsWithinAnyMemory) {
  std::vector<CompactRange> full;
  for (const View& view : first_) full.emplace_back(view.range);
  const PosedViews compact{.views = first_, .full = full};
  const auto whole = integrate({&compact, 1}, {.voxel_mm = 0.8});
  const auto in_places = integrate({&compact, 1}, {.voxel_mm = 0.8, .memory_bytes = 1, .max_bricks_per_axis = 2});
  expect_same_bits(whole, in_places);
  const auto plain = integrate_views(first_, {.voxel_mm = 0.8});
  ASSERT_TRUE(plain);
  EXPECT_NEAR(volume(whole->mesh), volume(plain->mesh), 1e-4 * volume(plain->mesh));
}

TEST(Integrate, BridgesOfUnseenSpaceBetweenCloseLegsAreCut) {
  const Solid tripod = join({rod({-10, 5, 0}, {-10, 50, 0}, 5), rod({10, 5, 0}, {10, 50, 0}, 5),
                             rod({-10, 50, 0}, {10, 50, 0}, 5), rod({0, 5, 5}, {0, 50, 9}, 5)});
  const auto views = take_views({.noise_mm = 0.03}, cast_into(tripod));
  const auto bridged = integrate_views(views, {.voxel_mm = 0.5, .repair_handles = false});
  const auto repaired = integrate_views(views);
  ASSERT_TRUE(bridged && repaired);
  EXPECT_GT(topology(bridged->mesh).genus(), 0);
  expect_closed(repaired->mesh, 0);
  EXPECT_EQ(repaired->report.genus, 0);
  EXPECT_GT(repaired->report.voxels_cut, 0U);
  EXPECT_NEAR(volume(repaired->mesh), volume(bridged->mesh), 0.01 * volume(bridged->mesh));
}

TEST(Integrate, AHoleThatOneViewLooksThroughStaysOpenHoweverNarrow) {
  const Rig rig{.mm_per_pixel = 0.2, .views = 12};
  const Solid plate = box({-14, 30, -3}, {14, 54, 3});
  const Eigen::Vector3d middle(0, 42, 0);
  const Eigen::Vector3d eye =
      take_views({.views = 1}, cast_into(plate)).front().range.camera_from_pose.inverse().translation();
  const Eigen::Vector3d along = (eye - middle).normalized();
  for (const double radius : {0.9, 1.4, 4.0}) {
    const Solid drilled = carve(plate, rod(middle - 30 * along, middle + 30 * along, radius));
    const auto surface = integrate_views(take_views(rig, cast_into(drilled)), {.voxel_mm = 0.4});
    ASSERT_TRUE(surface) << surface.error().message;
    expect_closed(surface->mesh, 1);
    EXPECT_EQ(surface->report.voxels_filled, 0U) << radius;
  }
}

TEST(Integrate, ImportedOrthographicScansWithoutBackgroundMakeAClosedSolid) {
  const Solid ring = torus({0, 30, 0}, Eigen::Vector3d::UnitZ(), 18, 7);
  std::vector<View> views;
  for (int i = 0; i < 12; ++i) {
    const double a = 2.0 * std::numbers::pi * i / 12;
    views.push_back(take_orthographic(cast_into(ring), {std::sin(a), 0, std::cos(a)}, {0, 30, 0}, 30, 0.4));
  }
  const auto surface = integrate_views(views);
  ASSERT_TRUE(surface) << surface.error().message;
  expect_closed(surface->mesh, 1);
  EXPECT_LE(accuracy(surface->mesh, ring).median, 0.01);
  const double truth = 2 * std::numbers::pi * std::numbers::pi * 18 * 49;
  EXPECT_NEAR(volume(surface->mesh), truth, 0.05 * truth);
}

TEST(Integrate, TableBoundsScansWithoutSilhouettesOnlyOnRequest) {
  const Solid sunk = sphere({0, 20, 0}, 25);  // reaches below the table
  std::vector<View> views;
  for (int i = 0; i < 8; ++i) {
    const double a = 2.0 * std::numbers::pi * i / 8;
    views.push_back(take_orthographic(cast_into(sunk), {std::sin(a), 0, std::cos(a)}, {0, 20, 0}, 30, 0.5));
  }
  const auto lowest = [&](bool table) {
    const auto surface = integrate_views(views, {.voxel_mm = 0.8, .table_without_silhouettes = table});
    float y = 1e9F;
    for (const auto& v : surface.value().mesh.vertices) y = std::min(y, v.y());
    return y;
  };
  EXPECT_LT(lowest(false), -3.0F);
  EXPECT_GT(lowest(true), -2.0F);
}

TEST(Integrate, RefusesUnsuitableInput) {
  const auto code = [](std::span<const PosedViews> poses, const VolumeOptions& options = {}) {
    return integrate(poses, options).error().code;
  };
  const std::vector<PosedViews> one = {{ball_views()}};
  EXPECT_EQ(code({}), ErrorCode::invalid_input);
  EXPECT_EQ(code(std::vector<PosedViews>(kMaxPoses + 1, one[0])), ErrorCode::invalid_input);
  EXPECT_EQ(code(std::vector<PosedViews>(3, one[0]), {.fusion = VolumeOptions::Fusion::paper}),
            ErrorCode::invalid_input);
  EXPECT_EQ(code(one, {.voxel_mm = 0.0}), ErrorCode::invalid_input);
  EXPECT_EQ(code(one, {.voxel_mm = 0.5, .band_mm = -1.0}), ErrorCode::invalid_input);
  std::vector<PosedViews> stretched = one;
  stretched[0].model_from_pose.linear() *= 1.01;
  EXPECT_EQ(code(stretched), ErrorCode::invalid_input);

  std::vector<View> views = {ball_views()[0]};
  views[0].range.normal = cv::Mat3f();
  EXPECT_EQ(code(std::vector<PosedViews>{{views}}), ErrorCode::invalid_input);
  views = {ball_views()[0]};
  views[0].silhouettes[0].outside_px = cv::Mat1f();
  EXPECT_EQ(code(std::vector<PosedViews>{{views}}), ErrorCode::invalid_input);
}

TEST(Integrate, NothingMeasuredIsDegenerate) {
  const auto views = take_views({.width = 40, .height = 30, .views = 2}, cast_into(sphere({500, 0, 0}, 1)));
  EXPECT_EQ(integrate_views(views).error().code, ErrorCode::degenerate);
}

TEST(Integrate, VoxelsTooSmallForTheMachineAreOutOfRange) {
  EXPECT_EQ(integrate_views(ball_views(), {.voxel_mm = 0.01}).error().code, ErrorCode::out_of_range);
}

TEST(Integrate, StopsOnRequest) {
  std::stop_source source;
  source.request_stop();
  const PosedViews pose{ball_views()};
  EXPECT_EQ(integrate({&pose, 1}, {}, {source.get_token(), {}}).error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
