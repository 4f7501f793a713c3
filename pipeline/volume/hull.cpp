#include "pipeline/volume/hull.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanrig {

void Hull::add_silhouette(const Silhouette& silhouette, const Transform& model_from_pose) {
  const Transform camera_from_model = silhouette.camera_from_pose * model_from_pose.inverse();
  outlines_.push_back(
      {&silhouette, camera_from_model.linear().cast<float>(), camera_from_model.translation().cast<float>()});
}

void Hull::add_table(const Transform& model_from_pose) {
  const Eigen::Vector3d down = model_from_pose.linear() * -Eigen::Vector3d::UnitY();
  tables_.emplace_back(down.cast<float>(), static_cast<float>(-down.dot(model_from_pose.translation())));
}

float Hull::distance(const Eigen::Vector3f& p) const {
  float result = std::max((box_.min() - p).maxCoeff(), (p - box_.max()).maxCoeff());
  for (const auto& table : tables_) result = std::max(result, table.signedDistance(p));
  for (const auto& outline : outlines_) result = std::max(result, outline.distance(p));
  return result;
}

bool Hull::is_beyond(const Eigen::Vector3f& p, float limit) const {
  return std::max((box_.min() - p).maxCoeff(), (p - box_.max()).maxCoeff()) > limit ||
         std::any_of(tables_.begin(), tables_.end(),
                     [&](const auto& table) { return table.signedDistance(p) > limit; }) ||
         std::any_of(outlines_.begin(), outlines_.end(),
                     [&](const auto& outline) { return outline.distance(p) > limit; });
}

Hull Hull::near(const Eigen::Vector3f& centre, float radius, float band) const {
  Hull result = *this;
  // A contour's distance changes by about a millimetre per millimetre; a quarter is left for perspective.
  std::erase_if(result.outlines_,
                [&](const Outline& outline) { return outline.distance(centre) < -(band + 1.25F * radius); });
  return result;
}

/// Bilinear in the image. The object is inside the image: outside the image the distance to its border is added.
float Hull::Outline::distance(const Eigen::Vector3f& point) const {
  const Eigen::Vector3f p = rotation * point + translation;
  if (!(p.z() > 0.0F)) return -std::numeric_limits<float>::infinity();
  const Projection& projection = silhouette->projection;
  const cv::Mat1f& px = silhouette->outside_px;
  const float at_u = static_cast<float>(projection.fx) * p.x() / p.z() + static_cast<float>(projection.cx);
  const float at_v = static_cast<float>(projection.fy) * p.y() / p.z() + static_cast<float>(projection.cy);
  const float u = std::clamp(at_u, 0.0F, static_cast<float>(px.cols) - 1.01F);
  const float v = std::clamp(at_v, 0.0F, static_cast<float>(px.rows) - 1.01F);
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
  const float* top = px[y];
  const float* bottom = px[y + 1];
  const float pixels = (1 - b) * ((1 - a) * top[x] + a * top[x + 1]) + b * ((1 - a) * bottom[x] + a * bottom[x + 1]);
  return (pixels + std::hypot(at_u - u, at_v - v)) * static_cast<float>(projection.mm_per_pixel(p.z()));
}

}  // namespace scanrig
