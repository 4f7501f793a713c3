#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <utility>

#include "core/image_codec.h"
#include "pipeline/reconstruct/rest_suggestion.h"
#include "pipeline/texture/render.h"

namespace scanrig {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

constexpr Rgb kUnseen = {255, 150, 30};
constexpr Rgb kTable = {74, 88, 104};
const cv::Vec3b kBackground(28, 23, 18);  // BGR, of the page's images
constexpr const char* kNoLooks = "image of a rest: the mesh lacks views, normals or colours";
constexpr double kDistanceMm = 700.0;  // of the eye; far enough that lines hardly converge
constexpr double kRoom = 1.12;         // around the object in the image
constexpr int kTableCorners = 96;
constexpr float kTableGapMm = 0.2F;  // below the object, so that neither shows through the other

Rgb shaded(const Rgb& colour, double light) {
  Rgb result;
  for (std::size_t k = 0; k < 3; ++k) result[k] = static_cast<std::uint8_t>(std::lround(light * colour[k]));
  return result;
}

/// On the table, its box around the axis.
Mesh lying(Mesh mesh, const Eigen::Quaterniond& rest_from_pose) {
  const Eigen::Matrix3f turn = rest_from_pose.toRotationMatrix().cast<float>();
  Eigen::AlignedBox3f box;
  for (Eigen::Vector3f& v : mesh.vertices) box.extend(v = turn * v);
  const Eigen::Vector3f onto(-box.center().x(), -box.min().y(), -box.center().z());
  const Eigen::Vector3f lamp = Eigen::Vector3f(-0.4F, 0.8F, 0.45F).normalized();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.vertices[v] += onto;
    mesh.normals[v] = turn * mesh.normals[v];
    const bool is_unseen = mesh.views[v] == 0;
    const double light = 0.5 + 0.5 * std::max(0.0, static_cast<double>(lamp.dot(mesh.normals[v])));
    mesh.colour[v] = shaded(is_unseen ? kUnseen : mesh.colour[v], is_unseen ? light : 0.5 + 0.5 * light);
  }
  return mesh;
}

void add_table(Mesh& mesh, float radius_mm) {
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int k = -1; k < kTableCorners; ++k) {
    const float angle = 2.0F * std::numbers::pi_v<float> * static_cast<float>(k) / kTableCorners;
    const float radius = k < 0 ? 0.0F : radius_mm;
    mesh.vertices.emplace_back(radius * std::cos(angle), -kTableGapMm, -radius * std::sin(angle));
    mesh.normals.emplace_back(Eigen::Vector3f::UnitY());
    mesh.colour.push_back(kTable);
  }
  for (std::uint32_t k = 0; k < kTableCorners; ++k) {
    mesh.faces.push_back({middle, middle + 1 + k, middle + 1 + (k + 1) % kTableCorners});
  }
}

/// From the side of the cameras, as high as they; the object fills the image.
Camera eye_on(const Mesh& object, const Calibration& calibration, const RestImageOptions& options) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : object.vertices) box.extend(v);
  const Eigen::Vector3d middle = box.center().cast<double>();
  const Eigen::Vector3d between = 0.5 * (calibration.left.camera_from_turntable.inverse().translation() +
                                         calibration.right.camera_from_turntable.inverse().translation());
  const Eigen::Vector3d forward = -between.normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  Camera eye;
  eye.camera_from_turntable.linear() << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  eye.camera_from_turntable.translation() = -eye.camera_from_turntable.linear() * (middle - kDistanceMm * forward);
  double reach = 1e-6;  // tangent to the farthest corner, in units of half the image's height
  for (const Eigen::Vector3f& v : object.vertices) {
    const Eigen::Vector3d p = eye.camera_from_turntable * v.cast<double>();
    const double sideways = std::abs(p.x()) * options.height / options.width;
    reach = std::max(reach, std::max(sideways, std::abs(p.y())) / p.z());
  }
  const double focal = 0.5 * options.height / (kRoom * reach);
  eye.projection = {.width = options.width,
                    .height = options.height,
                    .fx = focal,
                    .fy = focal,
                    .cx = 0.5 * (options.width - 1),
                    .cy = 0.5 * (options.height - 1)};
  return eye;
}

bool has_looks(const Mesh& mesh) {
  const std::size_t count = mesh.vertices.size();
  return mesh.views.size() == count && mesh.normals.size() == count && mesh.colour.size() == count;
}

Result<cv::Mat> draw_on_table(const Mesh& mesh, const Eigen::Quaterniond& rest_from_pose,
                              const Calibration& calibration, const RestImageOptions& options) {
  if (!has_looks(mesh)) return fail(ErrorCode::invalid_input, kNoLooks);
  Mesh scene = lying(mesh, rest_from_pose);
  const Camera eye = eye_on(scene, calibration, options);
  constexpr double kUnknownTableMm = 90.0;
  add_table(scene,
            static_cast<float>(calibration.table_radius_mm > 0.0 ? calibration.table_radius_mm : kUnknownTableMm));
  const auto renderer = MeshRenderer::create({.mesh = std::move(scene), .corner_uv = {}, .atlas = {}});
  if (!renderer) return pass_on(renderer);
  const auto image = renderer->render(eye, Transform::Identity(),
                                      {.surface = Paint::vertex_colour,
                                       .supersample = options.supersample,
                                       .smooth_edges_only = true,
                                       .background = kBackground});
  if (!image) return pass_on(image);
  return image->image;
}

Result<std::string> to_png(const cv::Mat& image) {
  const auto png = encode_png(image);
  if (!png) return pass_on(png);
  return std::string(reinterpret_cast<const char*>(png->data()), png->size());
}

/// The faces that were measured, moved.
void add_measured(const Mesh& from, const Transform& motion, Mesh& to) {
  const auto before = static_cast<std::uint32_t>(to.vertices.size());
  for (std::size_t v = 0; v < from.vertices.size(); ++v) {
    to.vertices.push_back((motion * from.vertices[v].cast<double>()).cast<float>());
    to.normals.push_back((motion.linear() * from.normals[v].cast<double>()).cast<float>());
  }
  to.views.insert(to.views.end(), from.views.begin(), from.views.end());
  to.colour.insert(to.colour.end(), from.colour.begin(), from.colour.end());
  for (const auto& face : from.faces) {
    if (std::ranges::any_of(face, [&](std::uint32_t v) { return from.views[v] == 0; })) continue;
    to.faces.push_back({face[0] + before, face[1] + before, face[2] + before});
  }
}

}  // namespace

Result<std::string> draw_rest(const Mesh& partial, const NextRest& next, const Calibration& calibration,
                              const RestImageOptions& options) {
  const auto image = draw_on_table(partial, next.turn, calibration, options);
  return image ? to_png(*image) : Result<std::string>(pass_on(image));
}

Result<std::string> draw_choice(const Mesh& pose1, const Mesh& pose2, const Transform& pose1_from_pose2,
                                const Calibration& calibration) {
  if (!has_looks(pose1) || !has_looks(pose2)) return fail(ErrorCode::invalid_input, kNoLooks);
  Mesh both;
  add_measured(pose1, Transform::Identity(), both);
  add_measured(pose2, pose1_from_pose2, both);
  constexpr RestImageOptions kHalf{.width = 320, .height = 320};
  const Eigen::Quaterniond behind(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  const auto from_front = draw_on_table(both, Eigen::Quaterniond::Identity(), calibration, kHalf);
  if (!from_front) return pass_on(from_front);
  const auto from_behind = draw_on_table(both, behind, calibration, kHalf);
  if (!from_behind) return pass_on(from_behind);
  cv::Mat image;
  cv::hconcat(*from_front, *from_behind, image);
  return to_png(image);
}

}  // namespace scanrig
