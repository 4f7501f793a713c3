#include "pipeline/deviation/deviation.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/deviation/part.h"

namespace scanrig {
namespace {

/// Points without faces, each with the direction in which its surface looks.
Mesh points(const std::vector<std::pair<Eigen::Vector3f, Eigen::Vector3f>>& all) {
  Mesh mesh;
  for (const auto& [point, normal] : all) {
    mesh.vertices.push_back(point);
    mesh.normals.push_back(normal.normalized());
  }
  return mesh;
}

TEST(DeviationTest, distancesFromABoxAreSignedAtFacesEdgesAndCorners) {
  const Mesh box = testing::box_mesh({0, 0, 0}, {10, 10, 10});
  const Mesh model = points({{{5, 11, 5}, {0, 1, 0}},        // above a face
                             {{5, 9.5F, 5}, {0, 1, 0}},      // below it
                             {{13, 14, 5}, {1, 1, 0}},       // beyond an edge, 3-4-5
                             {{9.9F, 9.8F, 5}, {1, 1, 0}},   // within the edge
                             {{11, 12, 12}, {1, 1, 1}},      // beyond a corner, 1-2-2
                             {{3, 3, 10.25F}, {0, 0, 1}}});  // above the diagonal that two triangles share
  const auto found = deviation_from(box, model, Transform::Identity());
  ASSERT_TRUE(found) << found.error().message;
  const std::vector<float> truth{1.0F, -0.5F, 5.0F, -0.1F, 3.0F, 0.25F};
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(found->mm[i], truth[i], 1e-5) << i;
  EXPECT_DOUBLE_EQ(found->known_share, 1.0);
  EXPECT_NEAR(found->min_mm, -0.5, 1e-6);
  EXPECT_NEAR(found->max_mm, 5.0, 1e-6);
  EXPECT_NEAR(found->mean_mm, 8.65 / 6.0, 1e-6);
}

TEST(DeviationTest, aSharpCornerPointsOutwardsAlthoughOneOfItsFacesDoesNot) {
  // A blade: beyond its edge the nearest point is on both faces, of which one looks away.
  Mesh blade;
  blade.vertices = {{0, 0, 0}, {0, 10, 0}, {-20, 0, 1}, {-20, 10, 1}, {-20, 0, -1}, {-20, 10, -1}};
  blade.faces = {{0, 1, 2}, {2, 1, 3}, {0, 4, 1}, {4, 5, 1}, {2, 3, 4}, {4, 3, 5}, {0, 2, 4}, {1, 5, 3}};
  const auto found = deviation_from(blade, points({{{0.5F, 5, 0.4F}, {1, 0, 0}}, {{0.5F, 5, -0.4F}, {1, 0, 0}}}),
                                    Transform::Identity());
  ASSERT_TRUE(found) << found.error().message;
  for (const float mm : found->mm) EXPECT_NEAR(mm, std::hypot(0.5, 0.4), 1e-5);
}

TEST(DeviationTest, whatIsNotKnownIsNotANumber) {
  Mesh sheet;  // open: a square that looks up
  sheet.vertices = {{0, 0, 0}, {0, 0, 10}, {10, 0, 10}, {10, 0, 0}};
  sheet.faces = {{0, 1, 2}, {0, 2, 3}};
  Mesh model = points({{{5, 1, 5}, {0, 1, 0}},    // over it
                       {{12, 0, 5}, {0, 1, 0}},   // beside it: the reference ends
                       {{5, -1, 5}, {0, -1, 0}},  // its reverse side
                       {{4, 1, 4}, {0, 1, 0}}});  // not measured
  model.views = {1, 1, 1, 0};
  const auto found = deviation_from(sheet, model, Transform::Identity());
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FLOAT_EQ(found->mm[0], 1.0F);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_TRUE(std::isnan(found->mm[i])) << i;
  EXPECT_DOUBLE_EQ(found->known_share, 0.25);
  model.views = {0, 0, 0, 0};
  const auto none = deviation_from(sheet, model, Transform::Identity());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::degenerate);
}

TEST(DeviationTest, aSwollenAndDentedPartShowsBothInItsOwnFrame) {
  const Mesh reference = deviation_part::part_mesh(1.2);
  Mesh model = reference;
  const Eigen::Vector3d dent(-12, 32, 4);  // top of the ball
  for (auto& vertex : model.vertices) {
    const Eigen::Vector3d p = vertex.cast<double>(), n = testing::outward_normal(deviation_part::part(), p);
    vertex += ((p - dent).norm() < 6.0 ? -0.4 : 0.1) * n.cast<float>();
  }
  const Transform motion = deviation_part::some_motion(50.0);
  const auto found = deviation_from(reference, deviation_part::moved_mesh(model, motion.inverse()), motion);
  ASSERT_TRUE(found) << found.error().message;
  int dented = 0;
  std::size_t swollen = 0;
  for (std::size_t v = 0; v < model.vertices.size(); ++v) {
    if ((reference.vertices[v].cast<double>() - dent).norm() < 5.0) {
      ++dented;
      EXPECT_NEAR(found->mm[v], -0.4, 0.04);
    } else if (std::abs(found->mm[v] - 0.1F) < 0.01F) {
      ++swollen;
    }
  }
  EXPECT_GT(dented, 20);
  EXPECT_GT(swollen, model.vertices.size() * 8 / 10) << "but near inner edges, where the nearest face is another";
}

}  // namespace
}  // namespace scanrig
