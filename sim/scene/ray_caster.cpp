#include "sim/scene/ray_caster.h"

#include <limits>

#include "core/embree.h"

namespace scanrig::sim {

struct RayCaster::Embree {
  RTCDevice device = new_embree_device();
  RTCScene scene = rtcNewScene(device);

  ~Embree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

namespace {

RTCRay ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float far) {
  RTCRay r{};
  const Eigen::Vector3f o = origin.cast<float>(), d = direction.cast<float>();
  r.org_x = o.x(), r.org_y = o.y(), r.org_z = o.z();
  r.dir_x = d.x(), r.dir_y = d.y(), r.dir_z = d.z();
  r.tfar = far;
  r.mask = ~0U;
  return r;
}

}  // namespace

RayCaster::RayCaster(const TriangleMesh& mesh) : embree_(std::make_unique<Embree>()) {
  RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices.size()));
  for (const auto& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) *vertices++ = static_cast<float>(v[i]);
  }
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    for (const int corner : t) *corners++ = static_cast<unsigned>(corner);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(embree_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips through between two triangles
  rtcCommitScene(embree_->scene);
}

RayCaster::~RayCaster() = default;

RayCaster::Hit RayCaster::first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  RTCRayHit query{ray(origin, direction, std::numeric_limits<float>::infinity()), {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  intersect(embree_->scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<int>(query.hit.primID), query.hit.u, query.hit.v};
}

bool RayCaster::blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& way) const {
  RTCRay query = ray(from, way, 1.0F);
  return occluded(embree_->scene, query);
}

}  // namespace scanrig::sim
