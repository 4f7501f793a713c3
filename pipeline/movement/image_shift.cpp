#include "pipeline/movement/image_shift.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

/// Sums over a square of products of gradient (2) and change, free of what another gain and offset of the light
/// explain.
struct Square {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  int values = 0;

  [[nodiscard]] Eigen::Matrix2d gradients() const { return products.topLeftCorner<2, 2>(); }
  /// Least squares: change = -gradient . shift
  [[nodiscard]] Eigen::Vector2d shift() const {
    return -(gradients() + 1e-9 * Eigen::Matrix2d::Identity()).inverse() * products.block<2, 1>(0, 2);
  }
  [[nodiscard]] double unexplained() const {
    const Eigen::Vector2d d = shift();
    return std::max(0.0, products(2, 2) - d.dot(gradients() * d));
  }
  Square& operator+=(const Square& other) {
    products += other.products;
    values += other.values;
    return *this;
  }
  /// Amount of structure: gradient squared, per value.
  [[nodiscard]] double contrast() const { return gradients().trace() / values; }
};

struct Channel {
  cv::Mat1f mean, dx, dy, change;
};

Channel channel(const cv::Mat& before, const cv::Mat& after, double smoothing_px) {
  Channel c;
  cv::Mat1f a, b;
  before.convertTo(a, CV_32F);
  after.convertTo(b, CV_32F);
  cv::GaussianBlur(a, a, {}, smoothing_px);
  cv::GaussianBlur(b, b, {}, smoothing_px);
  c.mean = 0.5 * (a + b);
  c.change = b - a;
  cv::Sobel(c.mean, c.dx, CV_32F, 1, 0, 1, 0.5);
  cv::Sobel(c.mean, c.dy, CV_32F, 0, 1, 1, 0.5);
  return c;
}

void add(const Channel& c, const cv::Rect& where, Square& square) {
  Eigen::Matrix<double, 5, 5> sums = Eigen::Matrix<double, 5, 5>::Zero();
  for (int y = where.y; y < where.y + where.height; ++y) {
    for (int x = where.x; x < where.x + where.width; ++x) {
      const Eigen::Matrix<double, 5, 1> v{1.0, c.mean(y, x), c.dx(y, x), c.dy(y, x), c.change(y, x)};
      sums.noalias() += v * v.transpose();
    }
  }
  Eigen::Matrix2d light = sums.topLeftCorner<2, 2>();
  light(1, 1) += where.area();  // in uniform grey, gain and offset are the same
  const Eigen::Matrix<double, 2, 3> by_light = sums.topRightCorner<2, 3>();
  square.products += sums.bottomRightCorner<3, 3>() - by_light.transpose() * light.inverse() * by_light;
  square.values += where.area();
}

std::vector<Square> squares(const std::vector<Channel>& channels, int side) {
  std::vector<Square> all;
  const cv::Size size = channels.front().mean.size();
  for (int y = 0; y + side <= size.height; y += side) {
    for (int x = 0; x + side <= size.width; x += side) {
      all.emplace_back();
      for (const auto& c : channels) add(c, {x, y, side, side}, all.back());
    }
  }
  return all;
}

/// Variance of a value's change without movement: the residual in the squares with the least change.
double noise_of(std::vector<Square> all, double min_noise) {
  std::ranges::sort(all, {}, &Square::contrast);
  all.resize((all.size() + 3) / 4);
  const auto left = [](const Square& square) { return square.unexplained() / square.values; };
  std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), {}, left);
  return std::max(left(all[all.size() / 2]), min_noise);
}

using Axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>;  ///< of the sums of gradients

/// The shift in those directions with eigenvalues of at least `min_structure`.
double shift_px(const Square& square, const Axes& axes, double min_structure) {
  const Eigen::Vector2d along = axes.eigenvectors().transpose() * square.shift();
  return (axes.eigenvalues().array() < min_structure).select(0.0, along.array()).matrix().norm();
}

ImageShift shift_of(const std::vector<Square>& all, const ImageShiftOptions& options) {
  ImageShift found;
  if (all.empty()) return found;
  const double noise = noise_of(all, options.min_noise);
  const double min_structure =
      options.correlated_pixels * noise / (options.max_noise_shift_px * options.max_noise_shift_px);
  Square together;
  for (const auto& square : all) {
    const Axes axes(square.gradients());
    if (axes.eigenvalues().maxCoeff() < min_structure) continue;
    const double misfit = std::max(0.0, square.unexplained() - noise * square.values);
    found.squares.push_back({shift_px(square, axes, min_structure), std::sqrt(misfit / square.gradients().trace())});
    if (found.squares.back().misfit_px <= options.max_misfit_px) together += square;
  }
  found.together_px = shift_px(together, Axes(together.gradients()), min_structure);
  return found;
}

}  // namespace

ImageShift image_shift(const cv::Mat& before, const cv::Mat& after, const ImageShiftOptions& options) {
  std::vector<cv::Mat> a, b;
  cv::split(before, a);
  cv::split(after, b);
  std::vector<Channel> channels;
  for (std::size_t i = 0; i < a.size(); ++i) channels.push_back(channel(a[i], b[i], options.smoothing_px));
  ImageShift found;
  for (int side = options.min_side_px; side <= options.max_side_px && found.squares.size() < options.good_squares;
       side *= 2) {
    auto larger = shift_of(squares(channels, side), options);
    if (larger.squares.size() > found.squares.size() || found.squares.empty()) found = std::move(larger);
  }
  return found;
}

}  // namespace scanrig
