#include "pipeline/range/row_offsets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/range/spline.h"
#include "pipeline/range/stereo.h"

namespace scanrig {
namespace {

constexpr int kRadius = 6;
constexpr int kSide = 2 * kRadius + 1;
constexpr int kBorder = kRadius + 3;  // the splines reach two pixels further, the offset one
constexpr int kSteps = 4;
constexpr double kExplainedPx = 0.25;   // from the field, or three sigma
constexpr double kLargestShare = 0.98;  // the largest offset is that of these: the last ones may be wrong
constexpr double kFloorPx = 0.002;      // no cell is surer: noise of neighbouring windows is not independent

using Terms = Eigen::Matrix<double, 6, 1>;

using Sample = RowSample;

/// One pixel of a window: the left image there, and where the right image shows it while rows correspond.
struct Pixel {
  float value, slope_u, slope_v;  // left
  float u;                        // right
  int v;
  int x;  // left
  float disparity;
};

struct Images {
  cv::Mat1f left, right;  // spline coefficients
};

float value_at(const cv::Mat1f& coefficients, float u, float v) {
  const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
  const auto across = spline_weights(u - static_cast<float>(column)),
             down = spline_weights(v - static_cast<float>(row));
  float value = 0.0F;
  for (int j = 0; j < 4; ++j) {
    const float* c = coefficients[row + j - 1] + column - 1;
    value +=
        down[static_cast<std::size_t>(j)] * (across[0] * c[0] + across[1] * c[1] + across[2] * c[2] + across[3] * c[3]);
  }
  return value;
}

/// Value and slopes of the left spline at a pixel.
Pixel left_pixel(const cv::Mat1f& c, int u, int v) {
  const auto smooth = [](float a, float b, float d) { return (a + 4.0F * b + d) / 6.0F; };
  const float *above = c[v - 1] + u, *here = c[v] + u, *below = c[v + 1] + u;
  const float up = smooth(above[-1], above[0], above[1]), middle = smooth(here[-1], here[0], here[1]),
              down = smooth(below[-1], below[0], below[1]);
  const float west = smooth(above[-1], here[-1], below[-1]), east = smooth(above[1], here[1], below[1]);
  return {smooth(up, middle, down), 0.5F * (east - west), 0.5F * (down - up), 0.0F, v, u, 0.0F};
}

/// Puts the pixels of a window on the plane through their disparities, those of another surface left out.
void to_plane(std::vector<Pixel>& pixels, const cv::Mat1f& disparity, int u, int v) {
  constexpr float kSamePx = 2.0F;
  const float centre = disparity(v, u);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int y = v - kRadius; y <= v + kRadius; ++y) {
    for (int x = u - kRadius; x <= u + kRadius; ++x) {
      const float off = disparity(y, x) - centre;
      if (!(std::abs(off) < kSamePx)) continue;
      const Eigen::Vector3d row(1.0, x - u, y - v);
      normal += row * row.transpose();
      sum += row * double(off);
    }
  }
  const Eigen::Vector3d plane = normal.ldlt().solve(sum);
  std::erase_if(pixels, [&](const Pixel& p) { return std::abs(p.disparity - centre) >= kSamePx; });
  for (Pixel& p : pixels) {
    p.u += p.disparity - centre - static_cast<float>(plane.dot(Eigen::Vector3d(1.0, p.x - u, p.v - v)));
  }
  const auto last = static_cast<float>(disparity.cols - 4);  // the spline reaches further
  std::erase_if(pixels, [last](const Pixel& p) { return !(p.u >= 3.0F && p.u <= last); });
}

/// The pixels of the window around (u, v) that have a sure disparity.
std::vector<Pixel> window_pixels(const Images& images, const cv::Mat1f& disparity, const cv::Mat1f& sigma, int u, int v,
                                 const RowOffsetOptions& options) {
  std::vector<Pixel> pixels;
  pixels.reserve(kSide * kSide);
  for (int y = v - kRadius; y <= v + kRadius; ++y) {
    for (int x = u - kRadius; x <= u + kRadius; ++x) {
      if (!(sigma(y, x) <= options.max_sigma_px)) continue;  // NaN too
      const float there = static_cast<float>(x) - disparity(y, x);
      if (there < 3.0F || there > static_cast<float>(disparity.cols - 4)) continue;
      pixels.push_back(left_pixel(images.left, x, y));
      pixels.back().u = there;
      pixels.back().disparity = disparity(y, x);
    }
  }
  if (options.is_coarse) to_plane(pixels, disparity, u, v);
  return pixels;
}

/// Where the right image is like the left one: shift across rows and its sigma. The shift along rows, gain and offset
/// are unknowns too, so that what the disparities lack does not act on the rows.
std::optional<std::pair<double, double>> row_shift(const cv::Mat1f& right, const std::vector<Pixel>& pixels,
                                                   const RowOffsetOptions& options) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  const auto row_of = [](const Pixel& p) {
    return Eigen::Vector4d(double(p.slope_u), double(p.slope_v), double(p.value), 1.0);
  };
  for (const Pixel& p : pixels) normal += row_of(p) * row_of(p).transpose();
  const Eigen::LDLT<Eigen::Matrix4d> solver(normal);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
  double along = 0.0, across = 0.0, squares = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    double all = 0.0;
    for (const Pixel& p : pixels) {
      const double value = double(
          value_at(right, p.u + static_cast<float>(along), static_cast<float>(p.v) + static_cast<float>(across)));
      sum += row_of(p) * value;
      all += value * value;
    }
    const Eigen::Vector4d fit = solver.solve(sum);
    if (!(fit[2] > 0.1)) return std::nullopt;  // the gain
    along -= fit[0] / fit[2];
    across -= fit[1] / fit[2];
    if (!(std::abs(along) < 1.0) || !(std::abs(across) < options.max_offset_px)) return std::nullopt;
    squares = std::max(0.0, all - fit.dot(sum)) / (fit[2] * fit[2]);
    if (std::hypot(fit[0], fit[1]) < 1e-3 * fit[2]) break;
  }
  Eigen::Vector4d second = Eigen::Vector4d::Zero();
  second[1] = 1.0;
  const double variance = solver.solve(second)[1] * squares / static_cast<double>(pixels.size());
  if (!(variance > 0.0)) return std::nullopt;
  return std::pair(across, std::sqrt(variance));
}

std::vector<Sample> measure_windows(const RectifiedPair& pair, const cv::Mat1f& disparity, const cv::Mat1f& sigma,
                                    const RowOffsetOptions& options, const RowField& corrected) {
  const Images images{spline_coefficients(pair.left), spline_coefficients(pair.right)};
  const int lines = std::max(0, (disparity.rows - 2 * kBorder + options.stride_px - 1) / options.stride_px);
  std::vector<std::vector<Sample>> found(static_cast<std::size_t>(lines));
  const Projection& p = pair.left_projection;
  parallel_for(found.size(), [&](std::size_t line) {
    const int v = kBorder + static_cast<int>(line) * options.stride_px;
    for (int u = kBorder; u < disparity.cols - kBorder; u += options.stride_px) {
      if (!(sigma(v, u) <= options.max_sigma_px)) continue;
      const auto pixels = window_pixels(images, disparity, sigma, u, v, options);
      if (static_cast<double>(pixels.size()) < options.min_filled * kSide * kSide) continue;
      const auto shift = row_shift(images.right, pixels, options);
      if (!shift) continue;
      const double depth = p.fx * pair.baseline_mm / (double(disparity(v, u)) - p.cx + pair.right_cx);
      const float u_right = static_cast<float>(u) - disparity(v, u);
      found[line].push_back({static_cast<float>(u), static_cast<float>(v), u_right, static_cast<float>(depth),
                             static_cast<float>(shift->first + corrected.at(double(u_right), v, disparity.size())),
                             static_cast<float>(shift->second)});
    }
  });
  std::vector<Sample> all;
  for (const auto& line : found) all.insert(all.end(), line.begin(), line.end());
  return all;
}

Terms terms_at(double u, double v, cv::Size image) {
  const double x = 2.0 * u / (image.width - 1) - 1.0, y = 2.0 * v / (image.height - 1) - 1.0;
  Terms terms;
  terms << 1.0, x, y, x * x, x * y, y * y;
  return terms;
}

double left_column(const Sample& s) { return double(s.u); }
double right_column(const Sample& s) { return double(s.u_right); }

/// The field by iterated weights (Cauchy's at two sigma of what it leaves); `scale` becomes the ratio of the scatter to
/// the samples' own sigmas, `covariance` the field's.
Terms fit_field(const std::vector<Sample>& samples, cv::Size image, double (*column)(const Sample&), double& scale,
                Eigen::Matrix<double, 6, 6>& normal) {
  // The bend is known before to be below half a pixel: a small object cannot measure it.
  const Terms prior = (Terms() << 1e-4, 1.0, 1.0, 4.0, 4.0, 4.0).finished();
  Terms field = Terms::Zero();
  scale = 0.0;
  for (int round = 0; round < 8; ++round) {
    normal = prior.asDiagonal();
    Terms sum = Terms::Zero();
    for (const Sample& s : samples) {
      const Terms terms = terms_at(column(s), double(s.v), image);
      const double sigma = double(s.sigma), off = (double(s.offset) - terms.dot(field)) / sigma;
      const double far = scale > 0.0 ? off / (2.0 * scale) : 0.0;
      const double weight = 1.0 / ((1.0 + far * far) * sigma * sigma * std::max(1.0, scale * scale));
      normal += weight * terms * terms.transpose();
      sum += weight * double(s.offset) * terms;
    }
    field = normal.ldlt().solve(sum);
    std::vector<double> off;
    for (const Sample& s : samples) {
      const Terms terms = terms_at(column(s), double(s.v), image);
      off.push_back(std::abs(double(s.offset) - terms.dot(field)) / double(s.sigma));
    }
    scale = 1.4826 * quantile(std::move(off), 0.5);
  }
  return field;
}

/// Weighted means of the samples that the field explains.
std::vector<RowOffset> mean_cells(const std::vector<Sample>& samples, const RowOffsets& offsets, cv::Size image,
                                  double scale, const RowOffsetOptions& options) {
  struct Sum {
    double weight = 0.0, u = 0.0, v = 0.0, depth = 0.0, offset = 0.0;
    int count = 0;
  };
  std::vector<Sum> sums(static_cast<std::size_t>(options.cells) * static_cast<std::size_t>(options.cells));
  for (const Sample& s : samples) {
    const double u = double(s.u), v = double(s.v), sigma = double(s.sigma) * std::max(1.0, scale);
    if (std::abs(double(s.offset) - offsets.at(u, v, image)) > 3.0 * sigma) continue;
    const int column = static_cast<int>(u) * options.cells / image.width;
    const int row = static_cast<int>(v) * options.cells / image.height;
    const int cell = row * options.cells + column;
    Sum& sum = sums[static_cast<std::size_t>(cell)];
    const double weight = 1.0 / (sigma * sigma);
    sum.weight += weight;
    sum.u += weight * u;
    sum.v += weight * v;
    sum.depth += weight * double(s.depth);
    sum.offset += weight * double(s.offset);
    ++sum.count;
  }
  std::vector<RowOffset> cells;
  for (const Sum& s : sums) {
    if (s.count < options.min_cell_windows) continue;
    cells.push_back({s.u / s.weight, s.v / s.weight, s.depth / s.weight, s.offset / s.weight,
                     std::hypot(1.0 / std::sqrt(s.weight), kFloorPx)});
  }
  return cells;
}

}  // namespace

double RowField::at(double u, double v, cv::Size image) const {
  return Eigen::Map<const Terms>(terms.data()).dot(terms_at(u, v, image));
}

std::string row_warning(const RowOffsets& offsets) {
  constexpr double kWarnPx = 0.5;
  if (offsets.windows == 0 || offsets.largest_px < kWarnPx) return {};
  return fmt::format(
      "rows of the right camera's image are {:.1f} px from where the calibration has them; this was corrected, but "
      "calibrate the cameras again",
      offsets.largest_px);
}

RowOffsets fit_row_offsets(const std::vector<RowSample>& samples, cv::Size image, const RowOffsetOptions& options) {
  RowOffsets offsets;
  if (static_cast<int>(samples.size()) < options.min_windows) return offsets;
  offsets.windows = static_cast<int>(samples.size());
  double scale = 1.0;
  Eigen::Matrix<double, 6, 6> normal;
  Eigen::Map<Terms>(offsets.right_field.terms.data()) = fit_field(samples, image, right_column, scale, normal);
  Eigen::Map<Terms>(offsets.left_field.terms.data()) = fit_field(samples, image, left_column, scale, normal);
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(normal);
  double squares = 0.0;
  std::vector<double> sizes;
  for (const Sample& s : samples) {
    const Terms terms = terms_at(double(s.u), double(s.v), image);
    squares += terms.dot(solver.solve(terms));
    const double here = offsets.at(double(s.u), double(s.v), image);
    if (std::abs(double(s.offset) - here) <= std::max(kExplainedPx, 3.0 * double(s.sigma))) {
      sizes.push_back(std::abs(here));
    }
  }
  offsets.sigma_px = std::sqrt(squares / static_cast<double>(samples.size()));
  offsets.explained = static_cast<double>(sizes.size()) / static_cast<double>(samples.size());
  if (!sizes.empty()) offsets.largest_px = quantile(std::move(sizes), kLargestShare);
  offsets.cells = mean_cells(samples, offsets, image, scale, options);
  return offsets;
}

RowOffsets find_row_offsets(const RectifiedPair& pair, const cv::Mat1f& disparity, const cv::Mat1f& sigma,
                            const RowOffsetOptions& options, const RowField& corrected) {
  RowOffsets offsets =
      fit_row_offsets(measure_windows(pair, disparity, sigma, options, corrected), disparity.size(), options);
  offsets.corrected = corrected;
  return offsets;
}

}  // namespace scanrig
