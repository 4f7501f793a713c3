#include "sim/scene/artefacts.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "sim/scene/object.h"
#include "sim/scene/profile.h"
#include "sim/scene/rests.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

struct Triangle {
  Vector3d middle, normal;
  double area = 0.0;
};

std::vector<Triangle> triangles_of(const TriangleMesh& mesh) {
  std::vector<Triangle> all;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const Vector3d n = (b - a).cross(c - a);
    all.push_back({(a + b + c) / 3.0, n.normalized(), 0.5 * n.norm()});
  }
  return all;
}

/// Area of the triangles that lie on the ball, all of which must look away from its centre.
double area_on_ball(const TriangleMesh& mesh, const Vector3d& centre, double radius) {
  double area = 0.0;
  for (const Triangle& t : triangles_of(mesh)) {
    const Vector3d out = t.middle - centre;
    if (std::abs(out.norm() - radius) > 1e-3 || std::abs(t.normal.dot(out.normalized())) < 0.99) continue;
    EXPECT_GT(t.normal.dot(out), 0.0);
    area += t.area;
  }
  return area;
}

/// Areas of the triangles that face along `normal`, by how far along it they are, to 1 um.
std::map<long, double> faces_along(const TriangleMesh& mesh, const Vector3d& normal) {
  std::map<long, double> areas;
  for (const Triangle& t : triangles_of(mesh)) {
    if (t.normal.dot(normal) > 1.0 - 1e-9) areas[std::lround(1e3 * t.middle.dot(normal))] += t.area;
  }
  return areas;
}

TEST(Artefacts, TheSphereIsABallOf25MmToAMicrometre) {
  const auto mesh = artefact("sphere");
  ASSERT_TRUE(mesh);
  EXPECT_NEAR(area_on_ball(*mesh, {0.0, 45.0, 0.0}, 12.5), M_PI * 25.0 * 25.0, 0.5);
}

TEST(Artefacts, TheBallBarHasTwoBallsWhoseCentresAre100MmApart) {
  const auto mesh = artefact("ball-bar");
  ASSERT_TRUE(mesh);
  // Both are found as the extremes along the bar.
  const Vector3d along(std::cos(40.0 * M_PI / 180.0), std::sin(40.0 * M_PI / 180.0), 0.0);
  const auto is_less = [&](const Vector3d& a, const Vector3d& b) { return a.dot(along) < b.dot(along); };
  const auto [low, high] = std::ranges::minmax_element(mesh->vertices, is_less);
  EXPECT_NEAR((*high - *low).norm(), 125.0, 5e-3);
  for (const double side : {-50.0, 50.0}) {
    const Vector3d centre = Vector3d(0.0, 52.0, 0.0) + side * along;
    EXPECT_NEAR(area_on_ball(*mesh, centre, 12.5), M_PI * 25.0 * 25.0, 0.5);
  }
}

TEST(Artefacts, ThePlaneIsOneFlatFaceThatLeansBack) {
  const auto mesh = artefact("plane");
  ASSERT_TRUE(mesh);
  const double lean = 15.0 * M_PI / 180.0;
  const auto faces = faces_along(*mesh, {0.0, std::sin(lean), std::cos(lean)});
  ASSERT_EQ(faces.size(), 1U);
  EXPECT_GE(faces.begin()->second, 90.0 * 80.0);
}

TEST(Artefacts, TheStepsAre20And30And35MmOverTheLowest) {
  const auto mesh = artefact("step-gauge");
  ASSERT_TRUE(mesh);
  const auto faces = faces_along(*mesh, Vector3d::UnitZ());
  ASSERT_EQ(faces.size(), 4U);
  std::vector<long> heights;
  for (const auto& [height, area] : faces) heights.push_back(height - faces.begin()->first);
  EXPECT_EQ(heights, (std::vector<long>{0, 20'000, 30'000, 35'000}));
}

TEST(Artefacts, StandUprightAndFitTheWorkingVolume) {
  for (const char* name : {"sphere", "ball-bar", "plane", "step-gauge"}) {
    const auto object = load_object(name, 100.0);
    ASSERT_TRUE(object) << object.error().message;
    EXPECT_TRUE(object->is_upright);
    EXPECT_EQ(object->name, name);
    const auto placed = upright_placements(object->mesh, 5, 2);
    ASSERT_TRUE(placed) << name << placed.error().message;
    for (const Transform& table_from_object : *placed) {
      EXPECT_NEAR((table_from_object.linear() * Vector3d::UnitY()).y(), 1.0, 1e-12);
      double low = 1e9;
      for (const auto& v : object->mesh.vertices) low = std::min(low, (table_from_object * v).y());
      EXPECT_NEAR(low, 0.0, 1e-9);
    }
    EXPECT_NE((*placed)[0].matrix(), (*placed)[1].matrix());
  }
  EXPECT_FALSE(artefact("cube"));
}

}  // namespace
}  // namespace scanrig::sim
