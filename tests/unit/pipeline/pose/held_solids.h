#pragma once

#include <string>

#include "tests/unit/pipeline/pose/solid_mesh.h"
#include "tests/unit/pipeline/pose/turned_solids.h"

/// Objects that stand on putty or pins, tilted in any way. Pose frames, mm.
namespace scanrig::testing {

struct NamedSolid {
  std::string name;
  Solid solid;  ///< around (0, 30, 0)
};

/// Ten objects without a symmetry.
inline std::vector<NamedSolid> lopsided_solids() {
  const auto tilted = [](const Solid& solid, double degrees, const Eigen::Vector3d& axis) {
    const Eigen::Translation3d middle(0, 25, 0);
    return moved(solid,
                 Transform(middle * Eigen::AngleAxisd(to_radians(degrees), axis.normalized()) * middle.inverse()));
  };
  return {{"workpiece", workpiece()},
          {"stool", together({block({-32, 0, -22}, {32, 20, 22}), block({-25, 15, -20}, {-13, 45, -2}),
                              block({10, 15, -15}, {28, 45, 15}), ball({-10, 20, 18}, 12)})},
          {"three balls", together({ball({0, 25, 0}, 22), ball({18, 40, 8}, 14), ball({-20, 15, 12}, 12)})},
          {"mug with a lug", together({mug(), block({-32, 10, -6}, {-18, 24, 10})})},
          {"bracket", together({block({-34, 0, -18}, {34, 9, 18}), block({-34, 0, -18}, {-24, 48, 18}),
                                upright_cylinder({16, 5, 4}, 9, 20), ball({-8, 12, -6}, 10), ball({-28, 40, 8}, 9)})},
          {"bottle with a grip", together({bottle(), block({10, 12, -5}, {34, 24, 6}), ball({-20, 40, 6}, 8)})},
          {"crossed bars", together({block({-36, 18, -8}, {36, 32, 8}),
                                     tilted(block({-8, 2, -9}, {7, 58, 6}), 25, {0, 0, 1}), ball({24, 34, 4}, 9)})},
          {"vase with a foot",
           together({vase(), block({-4, 0, 0}, {12, 10, 34}), ball({16, 52, -6}, 9), ball({-20, 30, -8}, 7)})},
          {"wedged block", together({tilted(block({-26, 6, -16}, {26, 40, 16}), 20, {1, 0, 1}), ball({-18, 44, 0}, 11),
                                     upright_cylinder({14, 10, 14}, 8, 34)})},
          {"prism with a bud", together({prism(5, 20, 46), ball({20, 36, 8}, 10), block({-28, 4, -6}, {-12, 16, 4}),
                                         ball({-6, 46, -8}, 8)})}};
}

/// `solid`, which lies in this ball; far from it a lesser distance that is found at once.
inline Solid bounded(const Solid& solid, const Eigen::Vector3d& centre, double radius) {
  return [=](const Eigen::Vector3d& p) {
    const double outside = (p - centre).norm() - radius;
    return outside > 1.0 ? outside : solid(p);
  };
}

/// The upper half of an ellipsoid on the table.
inline Solid putty(const Eigen::Vector2d& at, const Eigen::Vector3d& radii) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q(p.x() - at.x(), p.y(), p.z() - at.y());
    return std::max((q.cwiseQuotient(radii).norm() - 1.0) * radii.minCoeff(), -p.y());
  };
}

/// Where a solid is lowest, within `reach_mm` of a place of the table; nothing above it: far up.
inline double underside(const Solid& solid, double x, double z) {
  for (double y = 0.0; y < 80.0; y += std::max(0.05, 0.9 * solid({x, y, z}))) {
    if (solid({x, y, z}) < 0.1) return y;
  }
  return 80.0;
}

/// One pose of an object: as it stands, and what holds it there.
struct HeldPose {
  Transform pose_from_object = Transform::Identity();
  Solid object, fixture;  ///< in the pose's frame; `fixture` is empty for none
  [[nodiscard]] Solid all() const { return fixture ? together({object, fixture}) : object; }
};

enum class Holder { none, putty, pins };

/// The object turned by `turn`, its lowest point `lift_mm` above the table.
inline HeldPose held(const Solid& solid, const Eigen::Matrix3d& turn, Holder holder, double lift_mm) {
  HeldPose pose;
  pose.pose_from_object.linear() = turn;
  const Mesh mesh = mesh_of(solid, {-65, -35, -65}, {65, 100, 65}, 2.5);
  Eigen::Vector3d lowest(0, 1e9, 0), middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& v : mesh.vertices) {
    const Eigen::Vector3d p = turn * v.cast<double>();
    if (p.y() < lowest.y()) lowest = p;
    middle += p / static_cast<double>(mesh.vertices.size());
  }
  const Eigen::Vector3d shift(2.0 - middle.x(), lift_mm - lowest.y(), -3.0 - middle.z());
  pose.pose_from_object.translation() = shift;
  pose.object = moved(solid, pose.pose_from_object);
  const Eigen::Vector3d foot = lowest + shift;
  if (holder == Holder::putty) pose.fixture = putty({foot.x(), foot.z()}, {13, lift_mm + 6.0, 11});
  if (holder != Holder::pins) return pose;
  std::vector<Solid> pins;
  for (const double degrees : {10.0, 130.0, 250.0}) {
    const double x = foot.x() + 7.0 * std::cos(to_radians(degrees)), z = foot.z() + 7.0 * std::sin(to_radians(degrees));
    const double under = underside(pose.object, x, z);
    if (under < 60.0) pins.push_back(upright_cylinder({x, 0, z}, 2.2, under + 1.5));
  }
  pose.fixture = together(pins);
  return pose;
}

}  // namespace scanrig::testing
