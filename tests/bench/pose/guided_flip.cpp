// bench_guided_flip MESH SIZE_MM START: what scans on the other stable rests of an object are predicted to bring, from
// its partial model on rest number START, and what they bring. Range images are made by ray casting: with the noise,
// the grazing limit, the shadows of both cameras and of the projector, and the lost edges of the range stage. Truth is
// what the range images hold, on points spread over the true surface. Writes JSON to standard output.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/model_io/mesh_reader.h"
#include "pipeline/pose/next_rest.h"
#include "pipeline/volume/integrate.h"
#include "tests/bench/pose/depth_steps.h"

namespace {

using namespace scanrig;

constexpr double kPartialVoxelMm = 0.8;  // as a reconstruction takes for partial models
constexpr std::size_t kTruthSamples = 4000;
constexpr double kSameSurfaceMm = 0.6;     // between a true point and the depth at its pixel
constexpr double kSamePlaceDeg = 15.0;     // between a predicted rest and the true one that it stands for
constexpr double kMaxIncidenceDeg = 72.0;  // of a measured pixel, to cameras and projector
constexpr double kStepMm = 1.5;            // of depth: the window straddles it
constexpr int kLostBesideStepPx = 2;

/// The simulated rig's, at 0.45 of its resolution.
Calibration rig() {
  constexpr int kWidth = 576, kHeight = 432;
  constexpr double kFocalPx = 1920.0, kDistanceMm = 640.0, kAimHeightMm = 45.0, kHalfBaselineMm = 80.0;
  const double elevation = to_radians(22.0);
  const Eigen::Vector3d aim(0, kAimHeightMm, 0);
  const Eigen::Vector3d middle = aim + kDistanceMm * Eigen::Vector3d(0, std::sin(elevation), std::cos(elevation));
  Calibration calibration;
  for (const bool is_left : {true, false}) {
    Camera& camera = is_left ? calibration.left : calibration.right;
    const Eigen::Vector3d centre = middle + (is_left ? -kHalfBaselineMm : kHalfBaselineMm) * Eigen::Vector3d::UnitX();
    const Eigen::Vector3d forward = (aim - centre).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
    camera.camera_from_turntable.linear() << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    camera.camera_from_turntable.translation() = -camera.camera_from_turntable.linear() * centre;
    camera.projection = {.width = kWidth,
                         .height = kHeight,
                         .fx = kFocalPx,
                         .fy = kFocalPx,
                         .cx = 0.5 * (kWidth - 1),
                         .cy = 0.5 * (kHeight - 1)};
  }
  calibration.table_radius_mm = 90.0;
  return calibration;
}

struct Object {
  const Mesh& mesh;
  const SurfaceIndex& surface;
};

Eigen::Vector3d normal_of(const Mesh& mesh, std::uint32_t face) {
  const Mesh::Face& f = mesh.faces[face];
  const Eigen::Vector3d a = mesh.vertices[f[0]].cast<double>();
  return (mesh.vertices[f[1]].cast<double>() - a).cross(mesh.vertices[f[2]].cast<double>() - a).normalized();
}

/// Signed distance to the outline of what is 255, in pixels, positive outside.
cv::Mat1f outline_distance(const cv::Mat1b& inside) {
  cv::Mat1f to_inside, to_outside;
  cv::distanceTransform(255 - inside, to_inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(inside, to_outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat1f signed_px;
  cv::subtract(to_inside, to_outside, signed_px);
  for (float& d : signed_px) d += d > 0.0F ? -0.5F : 0.5F;
  return signed_px;
}

/// Depth of the object in a camera; NaN where it is not.
cv::Mat1f depth_in(const Object& object, const Camera& camera, const Transform& camera_from_object, cv::Mat1i& face) {
  const cv::Size size(camera.projection.width, camera.projection.height);
  cv::Mat1f depth(size, kUnmeasured);
  face = cv::Mat1i(size, -1);
  const Transform object_from_camera = camera_from_object.inverse();
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      const Eigen::Vector3d ray = object_from_camera.linear() * camera.projection.unproject(u, v, 1.0);
      const auto hit = object.surface.first_hit(object_from_camera.translation(), ray);
      if (!hit) continue;
      depth(v, u) = static_cast<float>(hit->distance);
      face(v, u) = static_cast<int>(hit->face);
    }
  });
  return depth;
}

/// The view at one table angle; its frame is the pose's turntable frame.
View view_of(const Object& object, const Transform& pose_from_object, double angle_rad, int index,
             const Calibration& calibration, unsigned seed) {
  const RigEyes eyes = rig_eyes(calibration);
  const Transform turned = rot_y(angle_rad);
  const Transform object_from_turntable = (turned * pose_from_object).inverse();
  std::array<Eigen::Vector3d, 3> at = {
      object_from_turntable * calibration.left.camera_from_turntable.inverse().translation(),
      object_from_turntable * calibration.right.camera_from_turntable.inverse().translation(),
      object_from_turntable * eyes.projector};
  View view{.index = index, .angle_rad = angle_rad, .range = {}, .silhouettes = {}};
  cv::Mat1i face;
  for (const Camera* camera : {&calibration.right, &calibration.left}) {  // the left one's depth is used below
    const Transform camera_from_pose = camera->camera_from_turntable * turned;
    view.range.depth = depth_in(object, *camera, camera_from_pose * pose_from_object, face);
    cv::Mat1b inside;
    cv::compare(face, 0, inside, cv::CMP_GE);
    view.silhouettes.insert(view.silhouettes.begin(),
                            Silhouette{camera->projection, camera_from_pose, outline_distance(inside)});
    view.range.projection = camera->projection;
    view.range.camera_from_pose = camera_from_pose;
  }
  RangeImage& range = view.range;
  range.sigma = cv::Mat1f(range.depth.size(), kUnmeasured);
  range.normal = cv::Mat3f(range.depth.size(), cv::Vec3f::all(kUnmeasured));
  cv::compare(face, 0, range.background, cv::CMP_LT);
  cv::erode(range.background, range.background, cv::Mat1b::ones(5, 5));
  const cv::Mat1b lost = beside_steps(range.depth, kStepMm, kLostBesideStepPx);
  const Transform camera_from_object = range.camera_from_pose * pose_from_object;
  const Transform object_from_camera = camera_from_object.inverse();
  const double min_cosine = std::cos(to_radians(kMaxIncidenceDeg));
  parallel_for(static_cast<std::size_t>(face.rows), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    std::mt19937 random(seed * 7919U + static_cast<unsigned>(v));
    std::normal_distribution<double> noise;
    for (int u = 0; u < face.cols; ++u) {
      if (face(v, u) < 0) continue;
      const Eigen::Vector3d normal = normal_of(object.mesh, static_cast<std::uint32_t>(face(v, u)));
      const Eigen::Vector3d point = object_from_camera * range.projection.unproject(u, v, range.depth(v, u));
      const bool is_measured = lost(v, u) == 0 && std::ranges::all_of(at, [&](const Eigen::Vector3d& eye) {
                                 return (eye - point).normalized().dot(normal) > min_cosine &&
                                        !object.surface.blocked(point + 0.02 * normal, eye);
                               });
      if (!is_measured) {
        range.depth(v, u) = kUnmeasured;
        continue;
      }
      const double sigma = 0.012 / (at[0] - point).normalized().dot(normal);
      range.depth(v, u) += static_cast<float>(sigma * noise(random));
      range.sigma(v, u) = static_cast<float>(sigma);
      const Eigen::Vector3f n = (camera_from_object.linear() * normal).cast<float>();
      range.normal(v, u) = cv::Vec3f(n.x(), n.y(), n.z());
    }
  });
  return view;
}

std::vector<double> angles() {
  std::vector<double> all;
  for (int view = 0; view < 8; ++view) all.push_back(to_radians(45.0 * view));
  return all;
}

std::vector<View> scan(const Object& object, const Transform& pose_from_object, const Calibration& calibration,
                       unsigned seed) {
  std::vector<View> views;
  for (const double angle : angles()) {
    const int index = static_cast<int>(views.size());
    views.push_back(view_of(object, pose_from_object, angle, index, calibration, 100 * seed + index));
  }
  return views;
}

/// Whether a range image holds the point.
bool is_in(const View& view, const Eigen::Vector3d& point_in_pose) {
  const RangeImage& range = view.range;
  const Eigen::Vector3d p = range.camera_from_pose * point_in_pose;
  const Eigen::Vector2d pixel = range.projection.project(p);
  if (!range.projection.contains(pixel)) return false;
  const float depth = range.depth(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x())));
  return std::abs(depth - p.z()) < kSameSurfaceMm;  // NaN is not
}

std::vector<bool> seen_in(const std::vector<View>& views, const std::vector<SurfaceSample>& samples,
                          const Transform& pose_from_object) {
  std::vector<bool> seen;
  for (const SurfaceSample& sample : samples) {
    seen.push_back(
        std::ranges::any_of(views, [&](const View& view) { return is_in(view, pose_from_object * sample.point); }));
  }
  return seen;
}

Transform placed(const StableRest& rest, const SolidProperties& properties) {
  Transform pose_from_object = Transform::Identity();
  pose_from_object.linear() =
      Eigen::Quaterniond::FromTwoVectors(rest.normal, -Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d centre = pose_from_object.linear() * properties.centre_of_mass;
  pose_from_object.translation() = Eigen::Vector3d(-centre.x(), rest.offset_mm, -centre.z());
  return pose_from_object;
}

double apart_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return to_degrees(std::acos(std::clamp(a.dot(b), -1.0, 1.0)));
}

/// Of another true rest: what a scan on it shows of what the first has not.
struct Truth {
  StableRest rest;
  double gain = 0.0, unseen_after = 0.0;
};

nlohmann::json to_json(const NextRest& next, const std::vector<Truth>& others, const Transform& object_from_pose1) {
  const Eigen::Vector3d normal = object_from_pose1.linear() * next.rest.normal;
  const auto nearest =
      std::ranges::min_element(others, {}, [&](const Truth& other) { return apart_deg(other.rest.normal, normal); });
  return {{"gain", next.gain},
          {"unseen_after", next.unseen_after},
          {"overlap", next.overlap},
          {"stiffness", next.stiffness},
          {"outlook", static_cast<int>(next.outlook)},
          {"is_true_rest", apart_deg(nearest->rest.normal, normal) < kSamePlaceDeg},
          {"true_rest", nearest - others.begin()},
          {"true_gain", nearest->gain},
          {"true_unseen_after", nearest->unseen_after}};
}

Result<nlohmann::json> measure(Mesh mesh, double size_mm, std::size_t start) {
  mesh = joined_vertices(mesh);
  auto properties = solid_properties(mesh);
  if (!properties) return pass_on(properties);
  for (Eigen::Vector3f& v : mesh.vertices) v *= static_cast<float>(size_mm / properties->size_mm);
  properties = solid_properties(mesh);
  const auto surface = SurfaceIndex::create(mesh);
  if (!surface) return pass_on(surface);
  const Object object{mesh, *surface};
  StableRestOptions exact;
  exact.dilation_mm = exact.dilation = 0.0;
  const auto stable = rests_on_hull(mesh, *properties, 0.0, exact);
  if (!stable) return pass_on(stable);
  if (stable->rests.size() < 2) return fail(ErrorCode::degenerate, "an object of one rest");
  const StableRest first = stable->rests[start % stable->rests.size()];
  const Transform pose1_from_object = placed(first, *properties);
  const Calibration calibration = rig();

  const auto views = scan(object, pose1_from_object, calibration, 1);
  const PosedViews posed{.views = views};
  const auto partial =
      integrate({&posed, 1}, {.voxel_mm = kPartialVoxelMm, .table_without_silhouettes = true, .untangle = false});
  if (!partial) return pass_on(partial);
  const auto begun = std::chrono::steady_clock::now();
  const auto found = next_rests(partial->mesh, angles(), rig_eyes(calibration));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  if (!found) return pass_on(found);

  std::vector<std::uint32_t> faces(mesh.faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) faces[f] = f;
  const auto samples = sample_surface(mesh, faces, kTruthSamples);
  const auto seen1 = seen_in(views, samples, pose1_from_object);
  const double unseen1 = static_cast<double>(std::count(seen1.begin(), seen1.end(), false)) / kTruthSamples;
  std::vector<Truth> others;
  for (const StableRest& rest : stable->rests) {
    if (apart_deg(rest.normal, first.normal) < kSamePlaceDeg) continue;
    const Transform pose2_from_object = placed(rest, *properties);
    const auto seen2 = seen_in(scan(object, pose2_from_object, calibration, 2), samples, pose2_from_object);
    std::size_t gained = 0;
    for (std::size_t i = 0; i < seen2.size(); ++i) gained += seen2[i] && !seen1[i] ? 1 : 0;
    const double share = static_cast<double>(gained) / kTruthSamples;
    others.push_back({rest, unseen1 > 0.0 ? share / unseen1 : 0.0, unseen1 - share});
  }
  if (others.empty()) return fail(ErrorCode::degenerate, "an object of one rest");
  nlohmann::json predicted = nlohmann::json::array(), true_rests = nlohmann::json::array();
  for (const NextRest& next : found->rests) predicted.push_back(to_json(next, others, pose1_from_object.inverse()));
  for (const Truth& other : others) true_rests.push_back({{"gain", other.gain}, {"unseen_after", other.unseen_after}});
  return nlohmann::json{{"unseen", found->unseen},
                        {"true_unseen", unseen1},
                        {"predicted", predicted},
                        {"true_rests", true_rests},
                        {"partial_faces", partial->mesh.faces.size()},
                        {"seconds", seconds}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 || std::atof(argv[2]) <= 0.0 || std::atoi(argv[3]) < 0) {
    fmt::print(stderr, "usage: bench_guided_flip MESH SIZE_MM START\n");
    return static_cast<int>(ExitCode::usage);
  }
  auto mesh = read_mesh(argv[1]);
  Result<nlohmann::json> json = fail(ErrorCode::internal, "not measured");
  if (mesh) with_threads(0, [&] { json = measure(std::move(*mesh), std::atof(argv[2]), std::atoi(argv[3])); });
  if (!mesh || !json) {
    const Error& error = mesh ? json.error() : mesh.error();
    fmt::print(stderr, "{}\n", error.message);
    return static_cast<int>(exit_code(error.code));
  }
  fmt::print("{}\n", json->dump());
  return 0;
}
