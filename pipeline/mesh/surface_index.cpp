#include "pipeline/mesh/surface_index.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/embree.h"

namespace scanrig {

struct SurfaceIndex::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Mesh::Face> faces;
  std::vector<std::uint32_t> numbers;  ///< of the faces in the mesh

  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  [[nodiscard]] Eigen::Vector3d corner(std::uint32_t face, int k) const {
    return vertices[faces[face][k]].cast<double>();
  }
};

namespace {

template <class Ray>
void set_ray(Ray& ray, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float far) {
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = 0.0F;
  ray.tfar = far;
  ray.mask = ~0U;
}

void query(RTCScene scene, const Eigen::Vector3d& centre, float radius, RTCPointQueryFunction function, void* user) {
  RTCPointQuery ball{};
  ball.x = static_cast<float>(centre.x());
  ball.y = static_cast<float>(centre.y());
  ball.z = static_cast<float>(centre.z());
  ball.radius = radius;
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene, &ball, &context, function, user);
}

constexpr float kEverywhere = std::numeric_limits<float>::infinity();

}  // namespace

SurfaceIndex::SurfaceIndex(std::unique_ptr<Scene> scene) : scene_(std::move(scene)) {}
SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
SurfaceIndex& SurfaceIndex::operator=(SurfaceIndex&&) noexcept = default;

Result<SurfaceIndex> SurfaceIndex::create(const Mesh& mesh) {
  std::vector<std::uint32_t> all(mesh.faces.size());
  std::iota(all.begin(), all.end(), 0U);
  return create(mesh, all);
}

Result<SurfaceIndex> SurfaceIndex::create(const Mesh& mesh, const std::vector<std::uint32_t>& faces) {
  if (faces.empty()) return fail(ErrorCode::degenerate, "the surface has no faces");
  auto scene = std::make_unique<Scene>();
  scene->vertices = mesh.vertices;
  scene->numbers = faces;
  for (const std::uint32_t face : faces) scene->faces.push_back(mesh.faces[face]);
  scene->device = new_embree_device();
  if (!scene->device) return fail(ErrorCode::internal, "Embree creates no device");
  scene->scene = rtcNewScene(scene->device);
  rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips through between two faces
  RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), scene->vertices.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Mesh::Face),
                                          scene->faces.size());
  if (vertices && indices) {
    std::copy(scene->vertices.begin(), scene->vertices.end(), static_cast<Eigen::Vector3f*>(vertices));
    std::copy(scene->faces.begin(), scene->faces.end(), static_cast<Mesh::Face*>(indices));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene->scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene->scene);
  if (rtcGetDeviceError(scene->device) != RTC_ERROR_NONE) {
    return fail(ErrorCode::internal, "Embree cannot take {} faces", scene->faces.size());
  }
  return SurfaceIndex(std::move(scene));
}

std::optional<SurfaceIndex::Hit> SurfaceIndex::first_hit(const Eigen::Vector3d& origin,
                                                         const Eigen::Vector3d& direction) const {
  RTCRayHit ray{};
  set_ray(ray.ray, origin, direction, kEverywhere);
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  intersect(scene_->scene, ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{ray.ray.tfar, scene_->numbers[ray.hit.primID], {1.0F - ray.hit.u - ray.hit.v, ray.hit.u, ray.hit.v}};
}

bool SurfaceIndex::blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  RTCRay ray{};
  set_ray(ray, from, to - from, 1.0F);
  return occluded(scene_->scene, ray);
}

SurfaceIndex::Nearest SurfaceIndex::nearest(const Eigen::Vector3d& point, double limit) const {
  struct Search {
    const Scene& scene;
    Eigen::Vector3d point;
    Nearest best;
  } search{*scene_, point, {}};
  search.best.distance = limit;
  const auto visit = [](RTCPointQueryFunctionArguments* arguments) {
    auto& s = *static_cast<Search*>(arguments->userPtr);
    const std::uint32_t face = arguments->primID;
    const Eigen::Vector3d q =
        nearest_on_triangle(s.point, s.scene.corner(face, 0), s.scene.corner(face, 1), s.scene.corner(face, 2));
    const double distance = (q - s.point).norm();
    if (!(distance < s.best.distance)) return false;
    s.best = {distance, s.scene.numbers[face], q};
    // A little more than the distance: the ball's centre is rounded to float.
    arguments->query->radius = static_cast<float>(distance + 1e-4);
    return true;
  };
  query(scene_->scene, point, static_cast<float>(limit), visit, &search);
  if (!(search.best.distance < limit)) search.best.distance = std::numeric_limits<double>::infinity();
  return search.best;
}

void SurfaceIndex::near(const Eigen::Vector3d& centre, double radius,
                        const std::function<void(std::uint32_t)>& visit) const {
  struct Search {
    const Scene& scene;
    const std::function<void(std::uint32_t)>& visit;
  } search{*scene_, visit};
  const auto pass = [](RTCPointQueryFunctionArguments* arguments) {
    const auto& s = *static_cast<Search*>(arguments->userPtr);
    s.visit(s.scene.numbers[arguments->primID]);
    return false;
  };
  query(scene_->scene, centre, static_cast<float>(radius), pass, &search);
}

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return a;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + ab * (d1 / (d1 - d3));
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  return a + (ab * vb + ac * vc) / (va + vb + vc);
}

}  // namespace scanrig
