#include "sim/scene/room_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "sim/scene/gathering.h"
#include "sim/scene/profile.h"
#include "sim/scene/screen_colour.h"
#include "sim/scene/surface_colour.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kVertexRays = 28;   // smoothed over the neighbours afterwards
constexpr int kTableRays = 300;   // a shadow on an even table shows every step
constexpr double kReach = 200.0;  // mm; no part of the object is farther

/// Light along a ray that leaves `from` (table frame) and meets no part of the object.
Vector3f room(const Vector3d& from, const Vector3d& direction, ScreenColour colour) {
  const Profile& p = profile();
  if (direction.y() >= 0.0) return Vector3f::Constant(static_cast<float>(0.7 + 0.3 * direction.y()));
  const double t = -from.y() / direction.y();
  const bool table = std::hypot(from.x() + t * direction.x(), from.z() + t * direction.z()) < p.table_radius_mm;
  return table ? Vector3f(0.9F * on_screen(p.table_albedo, colour))
               : Vector3f(0.5F * on_screen(p.backdrop_albedo, colour));
}

Surroundings gather(const RayCaster& rays, const Transform& object_from_table, const std::vector<Vector3d>& directions,
                    const Vector3d& from, const Vector3d& normal, ScreenColour colour) {
  const Vector3f mutual(0.16F, 0.15F, 0.14F);  // light between the object's own parts
  const Eigen::Matrix3d frame = frame_around(normal);
  Surroundings s;
  int open = 0;
  for (const auto& d : directions) {
    const Vector3d direction = frame * d;
    const Vector3d start = from + 0.05 * normal;
    if (rays.blocked(object_from_table * start, object_from_table.linear() * (kReach * direction))) {
      s.ambient += mutual;
    } else {
      s.ambient += room(start, direction, colour);
      ++open;
    }
  }
  const auto all = static_cast<float>(directions.size());
  s.ambient /= all;
  s.openness = static_cast<float>(open) / all;
  return s;
}

}  // namespace

RoomLight::RoomLight(const Object& object, const RayCaster& rays, const Transform& table_from_object,
                     ScreenColour colour)
    : vertices_(object.mesh.vertices.size()), table_(TableGrid::kAcross, TableGrid::kAcross, CV_32F) {
  const Transform object_from_table = table_from_object.inverse();
  const auto around_vertex = hemisphere(kVertexRays), over_table = hemisphere(kTableRays);
  constexpr std::size_t kChunk = 512;
  parallel_for((vertices_.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kChunk; i < std::min(vertices_.size(), (chunk + 1) * kChunk); ++i) {
      vertices_[i] = gather(rays, object_from_table, around_vertex, table_from_object * object.mesh.vertices[i],
                            table_from_object.linear() * object.normals[i], colour);
    }
  });
  for (int i = 0; i < 4; ++i) average_with_neighbours(object.mesh.triangles, vertices_);
  parallel_for(TableGrid::kAcross, [&](std::size_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < TableGrid::kAcross; ++i) {
      table_.at<float>(j, i) =
          gather(rays, object_from_table, over_table, TableGrid::node(i, j), Vector3d::UnitY(), colour).openness;
    }
  });
}

Surroundings RoomLight::on_table(double x, double z) const {
  const TableGrid::Place at = TableGrid::place(x, z);
  const int i = at.column, j = at.row;
  const float open = at.mixed(table_.at<float>(j, i), table_.at<float>(j, i + 1), table_.at<float>(j + 1, i),
                              table_.at<float>(j + 1, i + 1));
  return {Vector3f::Constant(0.9F * open + 0.1F * (1.0F - open)), open};
}

const std::array<RoomLight::SoftBox, 3>& RoomLight::soft_boxes() {
  static const std::array<SoftBox, 3> boxes = {{{Vector3d(-0.60, 0.65, 0.65).normalized(), 0.42},
                                                {Vector3d(0.75, 0.45, 0.55).normalized(), 0.36},
                                                {Vector3d(0.05, 0.90, -0.45).normalized(), 0.22}}};
  return boxes;
}

Vector3f RoomLight::irradiance(const Surroundings& surroundings, const Vector3d& normal) {
  constexpr double kWrap = 0.5;  // a box as wide as its distance lights a little past the edge
  const Profile& p = profile();
  double direct = 0.0;
  for (const auto& box : soft_boxes()) {
    direct += box.share * std::max(0.0, (normal.dot(box.towards) + kWrap) / (1.0 + kWrap));
  }
  // A covered place loses the boxes' light faster than the sky's.
  const double open = surroundings.openness;
  return static_cast<float>(p.ambient) * surroundings.ambient +
         Vector3f::Constant(static_cast<float>(p.broad_lights * direct * open * std::sqrt(open)));
}

}  // namespace scanrig::sim
