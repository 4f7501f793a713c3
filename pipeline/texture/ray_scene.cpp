#include "pipeline/texture/ray_scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstring>
#include <limits>
#include <utility>

namespace scanrig {

struct RayScene::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

RayScene::RayScene(std::unique_ptr<Scene> scene) : scene_(std::move(scene)) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

Result<RayScene> RayScene::create(const Mesh& mesh) {
  if (mesh.faces.empty()) return fail(ErrorCode::degenerate, "ray casting: the mesh has no faces");
  auto scene = std::make_unique<Scene>();
  scene->device = rtcNewDevice(nullptr);
  if (scene->device == nullptr) return fail(ErrorCode::internal, "ray casting: Embree gives no device");
  scene->scene = rtcNewScene(scene->device);
  rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips through between two faces

  RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), mesh.vertices.size());
  void* faces = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Mesh::Face),
                                        mesh.faces.size());
  if (vertices != nullptr && faces != nullptr) {
    std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
    std::memcpy(faces, mesh.faces.data(), mesh.faces.size() * sizeof(Mesh::Face));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene->scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene->scene);
  if (rtcGetDeviceError(scene->device) != RTC_ERROR_NONE) {
    return fail(ErrorCode::internal, "ray casting: Embree cannot take {} vertices and {} faces", mesh.vertices.size(),
                mesh.faces.size());
  }
  return RayScene(std::move(scene));
}

std::optional<RayScene::Hit> RayScene::first_hit(const Eigen::Vector3f& origin,
                                                 const Eigen::Vector3f& direction) const {
  RTCRayHit ray{};
  ray.ray.org_x = origin.x();
  ray.ray.org_y = origin.y();
  ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_->scene, &context, &ray);
#endif
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{ray.ray.tfar, ray.hit.primID, {1.0F - ray.hit.u - ray.hit.v, ray.hit.u, ray.hit.v}};
}

}  // namespace scanrig
