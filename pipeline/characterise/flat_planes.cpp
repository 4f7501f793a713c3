#include "pipeline/characterise/flat_planes.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace scanrig::flats {

Linear::Linear(const CharacteriseOptions& options) : full_(std::pow(2.0, options.bits) - 1.0), gamma_(options.gamma) {
  const auto count = static_cast<std::size_t>(full_) + 1;
  table_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    table_[i] = static_cast<float>(full_ * std::pow(static_cast<double>(i) / full_, 1.0 / gamma_));
  }
}

cv::Mat1f Linear::operator()(const cv::Mat& raw) const {
  cv::Mat1f linear(raw.rows, raw.cols);
  const std::size_t last = table_.size() - 1;
  for (int y = 0; y < raw.rows; ++y) {
    float* out = linear.ptr<float>(y);
    for (int x = 0; x < raw.cols; ++x) {
      const std::size_t value = raw.depth() == CV_8U ? raw.ptr<std::uint8_t>(y)[x] : raw.ptr<std::uint16_t>(y)[x];
      out[x] = table_[std::min(value, last)];
    }
  }
  return linear;
}

double Linear::rounding(double grey) const {
  if (gamma_ == 1.0) return NoiseModel::kRounding;
  const double share = std::max(grey, 0.5) / full_;
  const double slope = std::pow(share, 1.0 - gamma_) / gamma_;  // linear by coded
  return slope * slope * NoiseModel::kRounding;
}

cv::Mat1f plane_of(const cv::Mat1f& image, int place) {
  cv::Mat1f plane(image.rows / 2, image.cols / 2);
  for (int y = 0; y < plane.rows; ++y) {
    const float* in = image.ptr<float>(2 * y + place / 2) + place % 2;
    float* out = plane.ptr<float>(y);
    for (int x = 0; x < plane.cols; ++x) out[x] = in[2 * x];
  }
  return plane;
}

cv::Mat1f high_pass(const cv::Mat1f& plane, int window) {
  cv::Mat1f mean;
  cv::blur(plane, mean, {window, window}, {-1, -1}, cv::BORDER_REFLECT_101);
  cv::Mat1f passed;
  cv::subtract(plane, mean, passed);
  return passed;
}

double passed_share(int window) {
  // A pixel keeps 1 - 1/w^2. The tile's mean takes the squares of (tile - tile * window), kernels that are products of
  // one along x and the same along y.
  const int reach = window / 2;
  double of_tile = 0.0, of_both = 0.0, of_smooth = 0.0;
  for (int x = -reach; x < kTilePx + reach; ++x) {
    const double tile = x >= 0 && x < kTilePx ? 1.0 / kTilePx : 0.0;
    const int inside = std::min(kTilePx, x + reach + 1) - std::max(0, x - reach);
    const double smooth = static_cast<double>(inside) / kTilePx / window;
    of_tile += tile * tile;
    of_both += tile * smooth;
    of_smooth += smooth * smooth;
  }
  const double of_mean = of_tile * of_tile - 2.0 * of_both * of_both + of_smooth * of_smooth;
  return 1.0 - 1.0 / (static_cast<double>(window) * window) - of_mean;
}

namespace {

/// One place of a pair, high-passed.
struct PlacePair {
  cv::Mat1f first, second;
  cv::Mat1f difference;  ///< high-passed
  cv::Mat1f mean;        ///< high-passed
};

Tile tile_at(const PlacePair& place, const cv::Rect& area, const cv::Mat1b& left_out, int number, double full,
             double passed) {
  Tile tile;
  double grey = 0.0, differences = 0.0, difference_squares = 0.0, means = 0.0, mean_squares = 0.0;
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x) {
      if (!left_out.empty() && left_out(2 * y + number / 2, 2 * x + number % 2) != 0) continue;
      const float a = place.first(y, x), b = place.second(y, x);
      const double difference = static_cast<double>(place.difference(y, x)),
                   mean = static_cast<double>(place.mean(y, x));
      tile.is_clipped |= std::min(a, b) <= 0.0F || static_cast<double>(std::max(a, b)) >= full;
      grey += 0.5 * static_cast<double>(a + b);
      differences += difference;
      difference_squares += difference * difference;
      means += mean;
      mean_squares += mean * mean;
      ++tile.pixels;
    }
  }
  if (tile.pixels == 0) return tile;
  tile.grey = grey / tile.pixels;
  // About the tile's mean: a local mean is off by the curvature of the light, which is alike all over a tile.
  const auto variance = [&](double sum, double squares) {
    return (squares - sum * sum / tile.pixels) / (tile.pixels * passed);
  };
  tile.variance = 0.5 * variance(differences, difference_squares);
  tile.fixed = variance(means, mean_squares) - 0.5 * tile.variance;
  return tile;
}

}  // namespace

std::vector<Tile> tiles_of(const FlatPair& pair, const Linear& linear, int window, const cv::Mat1b& left_out) {
  const cv::Mat1f first = linear(pair.first), second = linear(pair.second);
  std::vector<Tile> tiles;
  for (int number = 0; number < kPlaces; ++number) {
    PlacePair place{plane_of(first, number), plane_of(second, number), {}, {}};
    cv::subtract(place.first, place.second, place.difference);
    cv::addWeighted(place.first, 0.5, place.second, 0.5, 0.0, place.mean);
    place.difference = high_pass(place.difference, window);
    place.mean = high_pass(place.mean, window);
    // A mirrored edge has another mean where light falls off: no tile is nearer to it than the window reaches.
    const int edge = window / 2;
    const double passed = passed_share(window);
    for (int y = edge; y + kTilePx + edge <= place.first.rows; y += kTilePx) {
      for (int x = edge; x + kTilePx + edge <= place.first.cols; x += kTilePx) {
        tiles.push_back(tile_at(place, {x, y, kTilePx, kTilePx}, left_out, number, linear.full(), passed));
      }
    }
  }
  return tiles;
}

}  // namespace scanrig::flats
