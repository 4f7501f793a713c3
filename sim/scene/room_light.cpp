#include "sim/scene/room_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "sim/scene/surface_colour.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kVertexRays = 28;   // smoothed over the neighbours afterwards
constexpr int kTableRays = 300;   // a shadow on an even table shows every step
constexpr double kReach = 200.0;  // mm; no part of the object is farther
constexpr int kGrid = 73;         // nodes across the table
constexpr int kMiddle = kGrid / 2;
constexpr double kGridStep = 2.5;  // mm between them

/// Directions over the hemisphere around +Z, spread evenly under the cosine law.
std::vector<Vector3d> hemisphere(int count) {
  std::vector<Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double r = std::sqrt((i + 0.5) / count), phi = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), std::sqrt(1.0 - r * r));
  }
  return directions;
}

/// Light along a ray that leaves `from` (table frame) and meets no part of the object.
Vector3f room(const Vector3d& from, const Vector3d& direction) {
  const Profile& p = profile();
  if (direction.y() >= 0.0) return Vector3f::Constant(static_cast<float>(0.7 + 0.3 * direction.y()));
  const double t = -from.y() / direction.y();
  const bool table = std::hypot(from.x() + t * direction.x(), from.z() + t * direction.z()) < p.table_radius_mm;
  return table ? Vector3f(0.9F * rgb(p.table_albedo)) : Vector3f(0.5F * rgb(p.backdrop_albedo));
}

Surroundings gather(const RayCaster& rays, const Transform& object_from_table, const std::vector<Vector3d>& directions,
                    const Vector3d& from, const Vector3d& normal) {
  const Vector3f mutual(0.16F, 0.15F, 0.14F);  // light between the object's own parts
  Eigen::Matrix3d frame;
  frame << normal.unitOrthogonal(), normal.cross(normal.unitOrthogonal()), normal;
  Surroundings s;
  int open = 0;
  for (const auto& d : directions) {
    const Vector3d direction = frame * d;
    const Vector3d start = from + 0.05 * normal;
    if (rays.blocked(object_from_table * start, object_from_table.linear() * (kReach * direction))) {
      s.ambient += mutual;
    } else {
      s.ambient += room(start, direction);
      ++open;
    }
  }
  const auto all = static_cast<float>(directions.size());
  s.ambient /= all;
  s.openness = static_cast<float>(open) / all;
  return s;
}

/// One step of averaging over the edges: removes the grain of the few rays.
void smooth(const std::vector<Eigen::Vector3i>& triangles, std::vector<Surroundings>& values) {
  std::vector<Surroundings> sum = values;
  std::vector<float> count(values.size(), 1.0F);
  for (const auto& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      const auto& other = values[t[(i + 1) % 3]];
      sum[t[i]].ambient += other.ambient;
      sum[t[i]].openness += other.openness;
      count[t[i]] += 1.0F;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = {sum[i].ambient / count[i], sum[i].openness / count[i]};
  }
}

}  // namespace

RoomLight::RoomLight(const Object& object, const RayCaster& rays, const Transform& table_from_object)
    : vertices_(object.mesh.vertices.size()), table_(kGrid, kGrid, CV_32F) {
  const Transform object_from_table = table_from_object.inverse();
  const auto around_vertex = hemisphere(kVertexRays), over_table = hemisphere(kTableRays);
  constexpr std::size_t kChunk = 512;
  parallel_for((vertices_.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kChunk; i < std::min(vertices_.size(), (chunk + 1) * kChunk); ++i) {
      vertices_[i] = gather(rays, object_from_table, around_vertex, table_from_object * object.mesh.vertices[i],
                            table_from_object.linear() * object.normals[i]);
    }
  });
  for (int i = 0; i < 4; ++i) smooth(object.mesh.triangles, vertices_);
  parallel_for(kGrid, [&](std::size_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < kGrid; ++i) {
      const Vector3d at(kGridStep * (i - kMiddle), 0.0, kGridStep * (j - kMiddle));
      table_.at<float>(j, i) = gather(rays, object_from_table, over_table, at, Vector3d::UnitY()).openness;
    }
  });
}

Surroundings RoomLight::on_table(double x, double z) const {
  const double u = std::clamp(x / kGridStep + kMiddle, 0.0, kGrid - 1.001);
  const double v = std::clamp(z / kGridStep + kMiddle, 0.0, kGrid - 1.001);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const auto fu = static_cast<float>(u - i), fv = static_cast<float>(v - j);
  const float open = (1.0F - fv) * ((1.0F - fu) * table_.at<float>(j, i) + fu * table_.at<float>(j, i + 1)) +
                     fv * ((1.0F - fu) * table_.at<float>(j + 1, i) + fu * table_.at<float>(j + 1, i + 1));
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
