#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "pipeline/mesh/decimate.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/topology.h"

namespace scanrig {
namespace {

Mesh tetrahedron(const Eigen::Vector3f& at = Eigen::Vector3f::Zero()) {
  Mesh mesh;
  mesh.vertices = {at, at + Eigen::Vector3f::UnitX(), at + Eigen::Vector3f::UnitY(), at + Eigen::Vector3f::UnitZ()};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

Mesh join(Mesh a, const Mesh& b) {
  const auto shift = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& f : b.faces) a.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  return a;
}

/// Around the y axis: `m` steps around the ring, `n` around the tube.
Mesh torus(float ring, float tube, int m, int n) {
  Mesh mesh;
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) {
      const float u = 2.0F * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(m);
      const float v = 2.0F * std::numbers::pi_v<float> * static_cast<float>(j) / static_cast<float>(n);
      const float r = ring + tube * std::cos(v);
      mesh.vertices.emplace_back(r * std::cos(u), tube * std::sin(v), r * std::sin(u));
      const auto at = [&](int a, int b) { return static_cast<std::uint32_t>((a % m) * n + b % n); };
      mesh.faces.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return mesh;
}

TEST(Topology, TetrahedronIsAWatertightSphere) {
  const Topology t = topology(tetrahedron());
  EXPECT_TRUE(t.watertight());
  EXPECT_EQ(t.components, 1U);
  EXPECT_EQ(t.genus(), 0);
}

TEST(Topology, TorusHasOneHandleAndTwoToriHaveTwo) {
  EXPECT_EQ(topology(torus(5, 2, 24, 12)).genus(), 1);
  const Topology two = topology(join(torus(5, 2, 24, 12), torus(5, 2, 8, 6)));
  EXPECT_EQ(two.components, 2U);
  EXPECT_EQ(two.genus(), 2);
}

TEST(Topology, MissingFaceLeavesThreeOpenEdges) {
  Mesh mesh = tetrahedron();
  mesh.faces.pop_back();
  EXPECT_EQ(topology(mesh).boundary_edges, 3U);
  EXPECT_FALSE(topology(mesh).watertight());
}

TEST(Topology, FaceTurnedRoundIsNotManifold) {
  Mesh mesh = tetrahedron();
  std::swap(mesh.faces[3][0], mesh.faces[3][1]);
  EXPECT_EQ(topology(mesh).non_manifold_edges, 3U);
}

TEST(Topology, EdgeOfFourFacesIsNotManifold) {
  Mesh mesh = join(tetrahedron(), tetrahedron());
  for (auto& f : mesh.faces) {  // both tetrahedra share the edge 0-1
    for (auto& v : f) v = v == 4 ? 0 : v == 5 ? 1 : v;
  }
  EXPECT_EQ(topology(mesh).non_manifold_edges, 1U);
  EXPECT_FALSE(topology(mesh).watertight());
}

TEST(Topology, SolidsThatTouchInOneVertexAreNotManifoldThere) {
  Mesh mesh = join(tetrahedron(), tetrahedron({-1, 0, 0}));
  for (auto& f : mesh.faces) {
    for (auto& v : f) v = v == 5 ? 0 : v;
  }
  const Topology t = topology(mesh);
  EXPECT_EQ(t.non_manifold_vertices, 1U);
  EXPECT_EQ(t.non_manifold_edges + t.boundary_edges, 0U);
  EXPECT_FALSE(t.watertight());
}

TEST(Topology, FaceThatNamesAVertexTwiceIsNotWatertight) {
  Mesh mesh = tetrahedron();
  mesh.faces.push_back({0, 1, 1});
  EXPECT_EQ(topology(mesh).degenerate_faces, 1U);
  EXPECT_FALSE(topology(mesh).watertight());
}

TEST(Topology, EmptyMeshIsNotWatertight) { EXPECT_FALSE(topology({}).watertight()); }

TEST(LargestComponent, KeepsTheBodyAndItsAttributesAndDropsBitsAndCavities) {
  Mesh cavity = torus(30, 1, 24, 12);  // larger in extent, but turned inside out
  for (auto& f : cavity.faces) std::swap(f[0], f[1]);
  Mesh mesh = join(join(tetrahedron(), torus(5, 2, 24, 12)), cavity);
  mesh.views.assign(mesh.vertices.size(), 1);
  mesh.views[4] = 7;  // the first vertex of the torus that stays
  const Mesh kept = largest_component(mesh);
  EXPECT_EQ(kept.vertices.size(), 24U * 12U);
  EXPECT_EQ(kept.views.at(0), 7);
  EXPECT_EQ(topology(kept).genus(), 1);
  EXPECT_EQ(genus_of_largest(mesh), 1);
  EXPECT_EQ(genus_of_largest({}), 0);
}

TEST(SolidProperties, TetrahedronHasItsTextbookVolumeAndCentre) {
  const auto solid = solid_properties(tetrahedron({100, 200, 300}));
  ASSERT_TRUE(solid);
  EXPECT_NEAR(solid->volume_mm3, 1.0 / 6.0, 1e-4);
  EXPECT_NEAR(solid->area_mm2, 1.5 + std::sqrt(3.0) / 2.0, 1e-4);
  EXPECT_LT((solid->centre_of_mass - Eigen::Vector3d(100.25, 200.25, 300.25)).norm(), 1e-3);
}

TEST(SolidProperties, FineTorusApproachesPappus) {
  const auto solid = solid_properties(torus(20, 5, 400, 200));
  ASSERT_TRUE(solid);
  const double pi = std::numbers::pi;
  EXPECT_NEAR(solid->volume_mm3, 2 * pi * pi * 20 * 25, 5.0);
  EXPECT_NEAR(solid->area_mm2, 4 * pi * pi * 20 * 5, 2.0);
  EXPECT_LT(solid->centre_of_mass.norm(), 1e-4);
}

TEST(SolidProperties, OpenSurfaceIsNotClosed) {
  Mesh mesh = tetrahedron();
  mesh.faces.pop_back();
  EXPECT_EQ(solid_properties(mesh).error().code, ErrorCode::not_closed);
}

TEST(SolidProperties, SurfaceTurnedInsideOutIsDegenerate) {
  Mesh mesh = tetrahedron();
  for (auto& f : mesh.faces) std::swap(f[0], f[1]);
  EXPECT_EQ(solid_properties(mesh).error().code, ErrorCode::degenerate);
}

TEST(VertexNormals, PointAwayFromTheTubeOfATorus) {
  const Mesh mesh = torus(20, 5, 200, 100);
  const auto normals = vertex_normals(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 97) {
    const Eigen::Vector3f p = mesh.vertices[v];
    const Eigen::Vector3f ring = 20.0F * Eigen::Vector3f(p.x(), 0, p.z()).normalized();
    EXPECT_GT(normals[v].dot((p - ring).normalized()), 0.999F);
  }
}

TEST(Decimate, HalvesATorusAndKeepsItsShapeWithinTheBound) {
  const Mesh mesh = torus(20, 5, 200, 100);
  const auto fewer = decimate(mesh, {.max_error_mm = 0.1});
  ASSERT_TRUE(fewer);
  EXPECT_LT(fewer->faces.size(), mesh.faces.size() / 2);
  EXPECT_TRUE(topology(*fewer).watertight());
  EXPECT_EQ(topology(*fewer).genus(), 1);
  for (const auto& f : fewer->faces) {  // the middle of a face is where it is furthest from the surface
    const Eigen::Vector3f p = (fewer->vertices[f[0]] + fewer->vertices[f[1]] + fewer->vertices[f[2]]) / 3.0F;
    EXPECT_LT(std::abs(std::hypot(std::hypot(p.x(), p.z()) - 20.0F, p.y()) - 5.0F), 0.2F);
  }
}

TEST(Decimate, StopsAtTheRequestedNumberOfFaces) {
  const auto fewer = decimate(torus(20, 5, 200, 100), {.max_error_mm = 1.0, .target_faces = 20000});
  ASSERT_TRUE(fewer);
  EXPECT_NEAR(static_cast<double>(fewer->faces.size()), 20000.0, 200.0);
}

TEST(Decimate, RefusesAnOpenMeshAndAnErrorThatIsNotPositive) {
  Mesh open = tetrahedron();
  open.faces.pop_back();
  EXPECT_EQ(decimate(open).error().code, ErrorCode::not_closed);
  EXPECT_EQ(decimate(tetrahedron(), {.max_error_mm = 0.0}).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
