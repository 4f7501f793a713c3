#include "pipeline/closure/patch_shift.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

constexpr int kPatch = 24;         ///< px
constexpr double kSmoothing = 1.0; ///< px: noise goes, and the demosaicing's own edges
constexpr double kSharp = 0.05;    ///< px: a direction in which the noise hides more than that is not looked at
constexpr double kCorrelated = 15.0;  ///< pixels that share their noise after smoothing and demosaicing

/// Sums over a patch of the products of 1, brightness, gradient (2) and change, free of what a gain and an offset of
/// the light explain: of gradient and change only.
struct Patch {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  int pixels = 0;

  [[nodiscard]] Eigen::Matrix2d gradients() const { return products.topLeftCorner<2, 2>(); }
  [[nodiscard]] Eigen::Vector2d solve() const {
    return -(gradients() + 1e-9 * Eigen::Matrix2d::Identity()).inverse() * products.block<2, 1>(0, 2);
  }
  /// Of the change, what no shift explains.
  [[nodiscard]] double unexplained() const {
    const Eigen::Vector2d d = solve();
    return std::max(0.0, products(2, 2) - d.dot(gradients() * d));
  }
};

struct Channel {
  cv::Mat1f mean, dx, dy, change;
};

Channel channel(const cv::Mat& before, const cv::Mat& after) {
  Channel c;
  cv::Mat1f a, b;
  before.convertTo(a, CV_32F);
  after.convertTo(b, CV_32F);
  cv::GaussianBlur(a, a, {}, kSmoothing);
  cv::GaussianBlur(b, b, {}, kSmoothing);
  c.mean = 0.5 * (a + b);
  c.change = b - a;
  cv::Sobel(c.mean, c.dx, CV_32F, 1, 0, 1, 0.5);
  cv::Sobel(c.mean, c.dy, CV_32F, 0, 1, 1, 0.5);
  return c;
}

void add(const Channel& c, const cv::Rect& where, Patch& patch) {
  Eigen::Matrix<double, 5, 5> sums = Eigen::Matrix<double, 5, 5>::Zero();
  for (int y = where.y; y < where.y + where.height; ++y) {
    for (int x = where.x; x < where.x + where.width; ++x) {
      const Eigen::Matrix<double, 5, 1> v{1.0, c.mean(y, x), c.dx(y, x), c.dy(y, x), c.change(y, x)};
      sums.noalias() += v * v.transpose();
    }
  }
  Eigen::Matrix2d light = sums.topLeftCorner<2, 2>();
  light(1, 1) += where.area();  // an even patch has no gain
  const Eigen::Matrix<double, 2, 3> by_light = sums.topRightCorner<2, 3>();
  patch.products += sums.bottomRightCorner<3, 3>() - by_light.transpose() * light.inverse() * by_light;
  patch.pixels += where.area();
}

/// Variance of the noise of a pixel's change: what the quarter of the patches that shows least is left with.
double noise_of(const std::vector<Patch>& patches) {
  std::vector<std::pair<double, double>> by_contrast;
  for (const auto& p : patches) by_contrast.emplace_back(p.gradients().trace() / p.pixels, p.unexplained() / p.pixels);
  std::ranges::sort(by_contrast);
  by_contrast.resize(std::max<std::size_t>(1, by_contrast.size() / 4));
  const auto middle = by_contrast.begin() + static_cast<std::ptrdiff_t>(by_contrast.size() / 2);
  std::ranges::nth_element(by_contrast, middle, {}, [](const auto& p) { return p.second; });
  return std::max(middle->second, 0.01);
}

}  // namespace

std::vector<PatchShift> patch_shifts(const cv::Mat& before, const cv::Mat& after) {
  std::vector<cv::Mat> a, b;
  cv::split(before, a);
  cv::split(after, b);
  std::vector<Channel> channels;
  for (std::size_t i = 0; i < a.size(); ++i) channels.push_back(channel(a[i], b[i]));
  std::vector<Patch> patches;
  for (int y = 0; y + kPatch <= before.rows; y += kPatch) {
    for (int x = 0; x + kPatch <= before.cols; x += kPatch) {
      patches.emplace_back();
      for (const auto& c : channels) add(c, {x, y, kPatch, kPatch}, patches.back());
    }
  }
  std::vector<PatchShift> shifts;
  if (patches.empty()) return shifts;
  const double noise = noise_of(patches);
  const double least = kCorrelated * noise / (kSharp * kSharp);
  for (const auto& patch : patches) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(patch.gradients());
    const Eigen::Vector2d shift = patch.solve();
    Eigen::Vector2d seen = axes.eigenvectors().transpose() * shift;
    if (axes.eigenvalues()(1) < least) continue;
    if (axes.eigenvalues()(0) < least) seen(0) = 0.0;
    const double more = std::max(0.0, patch.unexplained() - noise * patch.pixels);
    shifts.push_back({seen.norm(), std::sqrt(more / patch.gradients().trace())});
  }
  return shifts;
}

}  // namespace scanrig
