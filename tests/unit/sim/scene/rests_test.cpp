#include "sim/scene/rests.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>

#include "core/units.h"
#include "sim/scene/figurine.h"
#include "sim/scene/polygonise.h"
#include "tests/shared_data.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double degrees_between(const Vector3d& a, const Vector3d& b) {
  return to_degrees(std::acos(std::clamp(a.dot(b), -1.0, 1.0)));
}

TEST(StableRests, OfABoxAreItsSixSidesTheLargestMostLikely) {
  const auto rests = stable_rests(box({30.0, 20.0, 10.0}), 1);
  ASSERT_EQ(rests.size(), 6U);
  for (const auto& r : rests) EXPECT_NEAR(r.down.cwiseAbs().maxCoeff(), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(rests[0].down.z()), 1.0, 1e-9);
  EXPECT_NEAR(rests[0].height, 10.0, 1e-9);
  EXPECT_GT(rests[0].chance, rests[5].chance);
}

TEST(StableRests, LeaveOutASideOverWhichTheBodyFalls) {
  // A slanted prism: it falls off its lower end, because its centre of mass hangs over the edge.
  TriangleMesh slanted = box({5.0, 30.0, 5.0});
  for (auto& v : slanted.vertices) v.x() += 0.5 * v.y();
  for (const auto& r : stable_rests(slanted, 1)) EXPECT_LT(std::abs(r.down.y()), 0.9);
}

TEST(StableRests, OfABallAreNone) {
  const auto field = [](const Vector3d& p) { return p.norm() - 10.0; };
  const auto ball = polygonise(field, {Vector3d::Constant(-12.3), Vector3d::Constant(12.3)}, 0.6, 1.0);
  EXPECT_TRUE(stable_rests(ball, 1).empty());
  const auto placed = draw_placements(ball, 1, 2, false);
  ASSERT_FALSE(placed);
  EXPECT_EQ(placed.error().code, ErrorCode::degenerate);
}

TEST(Placements, StandOnTheTableWithTheCentreOfMassOverTheContacts) {
  const auto mesh = figurine(1.0);
  for (const std::uint64_t seed : {1, 2}) {
    const auto placements = draw_placements(mesh, seed, 2, false);
    ASSERT_TRUE(placements) << placements.error().message;
    for (const auto& table_from_object : *placements) {
      double lowest = 1e9;
      std::vector<Vector2d> contacts;
      for (const auto& v : mesh.vertices) {
        const Vector3d p = table_from_object * v;
        lowest = std::min(lowest, p.y());
        if (p.y() < 0.05) contacts.emplace_back(p.x(), p.z());
      }
      EXPECT_NEAR(lowest, 0.0, 1e-9);
      // Seen from the foot of the centre of mass the contacts lie all around: no half plane is free of them.
      const Vector3d mass = table_from_object * centre_of_mass(mesh);
      for (int i = 0; i < 72; ++i) {
        const Vector2d towards(std::cos(to_radians(5.0 * i)), std::sin(to_radians(5.0 * i)));
        double most = -1e9;
        for (const auto& c : contacts) most = std::max(most, towards.dot(c - Vector2d(mass.x(), mass.z())));
        EXPECT_GT(most, 0.0) << "seed " << seed << ", would fall towards " << towards.transpose();
      }
    }
    const Vector3d up1 = (*placements)[0].linear().row(1), up2 = (*placements)[1].linear().row(1);
    EXPECT_GT(degrees_between(up1, up2), 30.0);
  }
}

TEST(Placements, OfManyPosesAreOnRestsOfTheirOwnAsFarAsThereAre) {
  const auto mesh = box({30.0, 20.0, 10.0});
  const auto two = draw_placements(mesh, 5, 2, false), four = draw_placements(mesh, 5, 4, false);
  ASSERT_TRUE(two && four);
  for (int i = 0; i < 2; ++i) EXPECT_EQ((*two)[i].matrix(), (*four)[i].matrix());
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j) {
      const Vector3d up1 = (*four)[i].linear().row(1), up2 = (*four)[j].linear().row(1);
      EXPECT_GT(degrees_between(up1, up2), 30.0) << i << " and " << j;
    }
  }
  const auto eight = draw_placements(mesh, 5, 8, false);  // a box has six rests
  ASSERT_TRUE(eight);
  const Vector3d first = (*eight)[0].linear().row(1), seventh = (*eight)[6].linear().row(1);
  EXPECT_LT(degrees_between(first, seventh), 0.01);
  EXPECT_GT(rotation_angle((*eight)[0].linear() * (*eight)[6].linear().transpose()), 0.01);
}

TEST(Placements, OfAForgetfulOperatorUseTheSameRestTurned) {
  const auto placements = draw_placements(box({30.0, 20.0, 10.0}), 5, 2, true);
  ASSERT_TRUE(placements);
  const Vector3d up1 = (*placements)[0].linear().row(1), up2 = (*placements)[1].linear().row(1);
  EXPECT_LT(degrees_between(up1, up2), 0.01);
  EXPECT_GT(rotation_angle((*placements)[0].linear() * (*placements)[1].linear().transpose()), 0.01);
}

TEST(Placements, DependOnTheSeedAlone) {
  const auto mesh = box({30.0, 20.0, 10.0});
  const auto a = draw_placements(mesh, 7, 2, false), b = draw_placements(mesh, 7, 2, false);
  const auto c = draw_placements(mesh, 8, 2, false);
  EXPECT_EQ((*a)[1].matrix(), (*b)[1].matrix());
  EXPECT_NE((*a)[0].matrix(), (*c)[0].matrix());
}

TEST(Placements, OfAnObjectLargerThanTheWorkingVolumeAreRefused) {
  const auto placed = draw_placements(box({60.0, 20.0, 10.0}), 1, 2, false);
  ASSERT_FALSE(placed);
  EXPECT_EQ(placed.error().code, ErrorCode::invalid_input);
  EXPECT_NE(placed.error().message.find("larger than the working volume"), std::string::npos);
  EXPECT_TRUE(draw_placements(box({60.0, 20.0, 10.0}), 1, 2, false, true)) << "an operator can put anything down";
}

TEST(Placements, OfScannedObjectsFitAtHundredMillimetres) {
  const std::filesystem::path meshes = shared_data() / "meshes";
  if (!std::filesystem::exists(meshes)) GTEST_SKIP() << meshes << " is missing";
  for (const char* file : {"spot/spot_triangulated.obj", "igea_tri.ply", "ycb_banana/textured_simple_reoriented.obj"}) {
    const auto object = load_object(meshes / file, 100.0);
    ASSERT_TRUE(object) << object.error().message;
    for (const std::uint64_t seed : {1, 2}) {
      const auto placed = draw_placements(object->mesh, seed, 2, false);
      EXPECT_TRUE(placed) << file << ": " << placed.error().message;
    }
  }
}

}  // namespace
}  // namespace scanrig::sim
