#include "sim/scene/bounce_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "sim/scene/screen_colour.h"

namespace scanrig::sim {

using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double kOff = 0.05;  // mm, off its own surface
constexpr std::size_t kBounceChunk = 512;
constexpr double kMeanOver = 3.0;  // mm: colours that a bounce averages
constexpr int kNodes = TableGrid::kAcross * TableGrid::kAcross;

Vector3d node_at(int node) { return TableGrid::node(node % TableGrid::kAcross, node / TableGrid::kAcross); }

/// Of each vertex, in some triangle that has it.
std::vector<Vector3f> vertex_albedos(const Object& object) {
  std::vector<Vector3f> albedo(object.mesh.vertices.size(), Vector3f::Zero());
  for (int i = 0; i < static_cast<int>(object.mesh.triangles.size()); ++i) {
    const auto& t = object.mesh.triangles[i];
    for (int corner = 0; corner < 3; ++corner) {
      const double u = corner == 1 ? 1.0 : 0.0, v = corner == 2 ? 1.0 : 0.0;
      auto& of = albedo[t[corner]];
      if (of.isZero()) of = object.colour->albedo({object.mesh.vertices[t[corner]], i, u, v, kMeanOver});
    }
  }
  return albedo;
}

}  // namespace

BouncePaths::BouncePaths(const Object& object, const RayCaster& rays, const Transform& table_from_object,
                         ScreenColour colour)
    : table_from_object_(table_from_object),
      vertex_count_(static_cast<int>(object.mesh.vertices.size())),
      met_(static_cast<std::size_t>(vertex_count_) * kVertexRays + kNodes * kTableRays),
      albedo_(vertex_albedos(object)) {
  albedo_.push_back(on_screen(profile().table_albedo, colour));
  const auto around_vertex = hemisphere(kVertexRays), over_table = hemisphere(kTableRays);
  const auto fill = [&](const Vector3d& from, const Vector3d& normal, const std::vector<Vector3d>& directions,
                        int* met) {
    const Eigen::Matrix3d frame = frame_around(normal);
    for (const auto& d : directions) *met++ = met_by(rays, object, from + kOff * normal, frame * d);
  };
  const std::size_t all = static_cast<std::size_t>(vertex_count_) + kNodes;
  parallel_for((all + kBounceChunk - 1) / kBounceChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kBounceChunk; i < std::min(all, (chunk + 1) * kBounceChunk); ++i) {
      const int vertex = static_cast<int>(i), node = vertex - vertex_count_;
      if (node < 0) {
        fill(table_from_object * object.mesh.vertices[i], table_from_object.linear() * object.normals[i], around_vertex,
             &met_[i * kVertexRays]);
      } else {
        fill(
            node_at(node), Vector3d::UnitY(), over_table,
            &met_[static_cast<std::size_t>(vertex_count_) * kVertexRays + static_cast<std::size_t>(node) * kTableRays]);
      }
    }
  });
}

int BouncePaths::met_by(const RayCaster& rays, const Object& object, const Vector3d& from, const Vector3d& way) const {
  const Transform object_from_table = table_from_object_.inverse();
  const auto hit = rays.first_hit(object_from_table * from, object_from_table.linear() * way);
  if (hit.triangle >= 0) {
    const auto& t = object.mesh.triangles[hit.triangle];
    return hit.u > 0.5 ? t[1] : hit.v > 0.5 ? t[2] : t[0];
  }
  if (way.y() >= 0.0) return kNothing;
  const Vector3d on_table = from - from.y() / way.y() * way;
  if (std::hypot(on_table.x(), on_table.z()) > profile().table_radius_mm) return kNothing;
  const TableGrid::Place at = TableGrid::place(on_table.x(), on_table.z());
  return vertex_count_ + at.row * TableGrid::kAcross + at.column;
}

BounceLight::BounceLight(const BouncePaths& paths, const Object& object, const RayCaster& rays, const Lamp& lamp,
                         const Transform& turntable_from_table)
    : vertices_(paths.vertex_count_), nodes_(kNodes) {
  const Transform turntable_from_object = turntable_from_table * paths.table_from_object_;
  const Transform object_from_turntable = turntable_from_object.inverse();
  const auto lit = [&](const Vector3d& point, const Vector3d& normal) {
    const Vector3d from = point + kOff * normal, way = lamp.place() - from;
    const double cosine = normal.dot(way.normalized());
    if (cosine <= 0.0 || rays.blocked(object_from_turntable * from, object_from_turntable.linear() * way)) return 0.0;
    return lamp.mean_irradiance(lamp.beam(point, kMeanOver), cosine);
  };
  // What each vertex and node sends out, then what each takes in.
  const int count = paths.vertex_count_;
  std::vector<Vector3f> sent(static_cast<std::size_t>(count) + kNodes);
  const auto chunks = (sent.size() + kBounceChunk - 1) / kBounceChunk;
  const auto each = [&](const auto& body) {
    parallel_for(chunks, [&](std::size_t chunk) {
      for (std::size_t i = chunk * kBounceChunk; i < std::min(sent.size(), (chunk + 1) * kBounceChunk); ++i)
        body(static_cast<int>(i));
    });
  };
  each([&](int i) {
    const double light = i < count ? lit(turntable_from_object * object.mesh.vertices[i],
                                         turntable_from_object.linear() * object.normals[i])
                                   : lit(turntable_from_table * node_at(i - count), Vector3d::UnitY());
    sent[i] = static_cast<float>(light) * paths.albedo_[std::min(i, count)];
  });
  each([&](int i) {
    const bool is_vertex = i < count;
    const int number = is_vertex ? BouncePaths::kVertexRays : BouncePaths::kTableRays;
    const int* met = is_vertex ? &paths.met_[static_cast<std::size_t>(i) * number]
                               : &paths.met_[static_cast<std::size_t>(count) * BouncePaths::kVertexRays +
                                             static_cast<std::size_t>(i - count) * number];
    Vector3f sum = Vector3f::Zero();
    for (int ray = 0; ray < number; ++ray)
      if (met[ray] != BouncePaths::kNothing) sum += sent[met[ray]];
    (is_vertex ? vertices_[i] : nodes_[i - count]) = sum / static_cast<float>(number);
  });
  for (int i = 0; i < 3; ++i) average_with_neighbours(object.mesh.triangles, vertices_);
}

Vector3f BounceLight::on_table(double x, double z) const {
  const TableGrid::Place at = TableGrid::place(x, z);
  const Vector3f* node = &nodes_[at.row * TableGrid::kAcross + at.column];
  return at.mixed(node[0], node[1], node[TableGrid::kAcross], node[TableGrid::kAcross + 1]);
}

}  // namespace scanrig::sim
