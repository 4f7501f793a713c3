#include "sim/scene/surface_colour.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanrig::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

class VertexColour final : public SurfaceColour {
 public:
  VertexColour(std::vector<Vector3f> colours, std::vector<Eigen::Vector3i> triangles)
      : colours_(std::move(colours)), triangles_(std::move(triangles)) {}

  Vector3f albedo(const SurfacePoint& p) const override {
    const auto& t = triangles_[p.triangle];
    const auto u = static_cast<float>(p.u), v = static_cast<float>(p.v);
    return measurable((1.0F - u - v) * colours_[t[0]] + u * colours_[t[1]] + v * colours_[t[2]]);
  }

 private:
  std::vector<Vector3f> colours_;
  std::vector<Eigen::Vector3i> triangles_;
};

float linear_from_srgb(float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); }

int wrapped(int i, int size) { return ((i % size) + size) % size; }

class ImageColour final : public SurfaceColour {
 public:
  ImageColour(const cv::Mat& image, std::vector<std::array<Vector2f, 3>> corners, const std::vector<double>& areas)
      : corners_(std::move(corners)) {
    cv::Mat table(1, 256, CV_32F), linear;
    for (int i = 0; i < 256; ++i) table.at<float>(i) = linear_from_srgb(static_cast<float>(i) / 255.0F);
    cv::cvtColor(image, linear, cv::COLOR_BGR2RGB);
    cv::LUT(linear, table, linear);
    levels_.push_back(linear);
    while (std::min(levels_.back().cols, levels_.back().rows) > 4) {
      const cv::Mat& finer = levels_.back();
      cv::Mat coarser;
      cv::resize(finer, coarser, {(finer.cols + 1) / 2, (finer.rows + 1) / 2}, 0, 0, cv::INTER_AREA);
      levels_.push_back(coarser);
    }
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Vector2f a = corners_[i][1] - corners_[i][0], b = corners_[i][2] - corners_[i][0];
      const double texels = 0.5 * std::abs(a.x() * b.y() - a.y() * b.x()) * image.cols * image.rows;
      texels_per_mm_.push_back(static_cast<float>(areas[i] > 0.0 ? std::sqrt(texels / areas[i]) : 0.0));
    }
  }

  Vector3f albedo(const SurfacePoint& p) const override {
    const auto& c = corners_[p.triangle];
    const auto u = static_cast<float>(p.u), v = static_cast<float>(p.v);
    const Vector2f at = (1.0F - u - v) * c[0] + u * c[1] + v * c[2];
    const float texels = std::max(1.0F, texels_per_mm_[p.triangle] * static_cast<float>(p.footprint_mm));
    const float level = std::min(std::log2(texels), static_cast<float>(levels_.size() - 1));
    const auto fine = static_cast<std::size_t>(level);
    const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
    const float share = level - static_cast<float>(fine);
    return measurable((1.0F - share) * bilinear(levels_[fine], at) + share * bilinear(levels_[coarse], at));
  }

 private:
  static Vector3f bilinear(const cv::Mat& level, const Vector2f& at) {
    const float x = (at.x() - std::floor(at.x())) * static_cast<float>(level.cols) - 0.5F;
    const float y = (1.0F - (at.y() - std::floor(at.y()))) * static_cast<float>(level.rows) - 0.5F;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
    const auto texel = [&](int dx, int dy) {
      const auto& c = level.at<cv::Vec3f>(wrapped(y0 + dy, level.rows), wrapped(x0 + dx, level.cols));
      return Vector3f(c[0], c[1], c[2]);
    };
    return (1.0F - fy) * ((1.0F - fx) * texel(0, 0) + fx * texel(1, 0)) +
           fy * ((1.0F - fx) * texel(0, 1) + fx * texel(1, 1));
  }

  std::vector<std::array<Vector2f, 3>> corners_;
  std::vector<float> texels_per_mm_;
  std::vector<cv::Mat> levels_;
};

}  // namespace

Vector3f measurable(const Vector3f& albedo) {
  constexpr float kDarkest = 0.12F, kBrightest = 0.9F, kBlueLimit = 1.1F;
  // A soft floor keeps the contrast of dark textures; a hard one would leave flat areas.
  Vector3f c = albedo.array().max(0.0F) * (kBrightest - kDarkest) / kBrightest + kDarkest;
  c = c.cwiseMin(kBrightest);
  c.z() = std::min(c.z(), kBlueLimit * std::max(c.x(), c.y()));
  return c;
}

std::unique_ptr<SurfaceColour> vertex_colour(std::vector<Vector3f> colours, std::vector<Eigen::Vector3i> triangles) {
  return std::make_unique<VertexColour>(std::move(colours), std::move(triangles));
}

std::unique_ptr<SurfaceColour> image_colour(const cv::Mat& image, std::vector<std::array<Vector2f, 3>> corners,
                                            const std::vector<double>& triangle_area_mm2) {
  return std::make_unique<ImageColour>(image, std::move(corners), triangle_area_mm2);
}

}  // namespace scanrig::sim
