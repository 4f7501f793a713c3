#include "sim/scene/board.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "sim/scene/marker_dictionary.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kCells = 8;             // of a square: margin, six of a marker, margin
constexpr double kReach = 3.5;        // sigmas
constexpr double kInkSpread = 0.015;  // mm, sigma of a printed edge

double gaussian_integral(double x) { return 0.5 + 0.5 * std::erf(x / std::numbers::sqrt2); }

}  // namespace

struct PrintedBoard::Cover {
  static constexpr int kMax = 64;
  int first = 0;
  int count = 0;
  std::array<double, kMax> share{};
};

Vector2d BoardLayout::corner(int id) const {
  const int column = id % corner_columns(), row = id / corner_columns();
  return square_mm * Vector2d(column + 1 - 0.5 * columns, row + 1 - 0.5 * rows);
}

PrintedBoard::PrintedBoard(const BoardLayout& layout, const PrintErrors& errors, std::uint64_t seed)
    : layout_(layout),
      errors_(errors),
      black_(static_cast<std::size_t>(layout.columns * layout.rows * kCells * kCells)) {
  const auto draw = [&](int purpose, int n) { return normal(mix(seed, 0x626f, purpose, n)); };
  const double scale = 1.0 + errors.scale + errors.scale_sigma * draw(0, 0), aspect = errors.aspect * draw(0, 1);
  printed_from_ordered_ << scale * (1.0 - 0.5 * aspect), errors.shear * draw(0, 2), 0.0, scale * (1.0 + 0.5 * aspect);
  ordered_from_printed_ = printed_from_ordered_.inverse();
  for (int id = 0; id < layout.corner_count(); ++id) {
    displaced_.emplace_back(errors.corner_mm * draw(1, id), errors.corner_mm * draw(2, id));
  }
  // The largest height is at a corner of the print.
  warp_ << draw(3, 0), draw(3, 1), 0.0, draw(3, 2);
  const Vector2d half(0.5 * layout.width(), 0.5 * layout.height()), other(half.x(), -half.y());
  const double largest = std::max({std::abs(half.dot(warp_ * half)), std::abs(other.dot(warp_ * other)),
                                   std::abs(warp_(0, 0)) * half.x() * half.x()});
  warp_ *= errors.warp_mm / largest;
  for (int i = 0; i < static_cast<int>(errors.dirt); ++i) {
    const auto even = [&](int n) { return uniform(mix(seed, 0x6472, i, n)); };
    const double radius = 0.2 + 1.3 * even(2) * even(3);
    dirt_.push_back({{(even(0) - 0.5) * layout.width(), (even(1) - 0.5) * layout.height()},
                     radius,
                     0.2 + 0.5 * radius * even(4),
                     0.1 + 0.5 * even(5)});
  }
  print_markers();
}

void PrintedBoard::print_markers() {
  const double size = layout_.marker_mm > 0.0 ? layout_.marker_mm : 0.6 * layout_.square_mm;
  edges_[0] = 0.0, edges_[kCells] = layout_.square_mm;
  for (int i = 0; i <= 6; ++i) edges_[i + 1] = 0.5 * (layout_.square_mm - size) + size / 6.0 * i;
  const auto markers = dict_4x4_100();
  assert(layout_.marker_count() <= static_cast<int>(markers.size()));
  int id = 0;
  for (int square = 0; square < layout_.columns * layout_.rows; ++square) {
    const int column = square % layout_.columns, row = square / layout_.columns;
    const bool black = (column + row) % 2 == 0;
    for (int cell = 0; cell < kCells * kCells; ++cell) {
      const int x = cell % kCells, y = cell / kCells;
      bool ink = black;
      if (!black && layout_.marker_mm > 0.0) {
        const bool bit = x >= 2 && x <= 5 && y >= 2 && y <= 5;
        const bool frame = !bit && x >= 1 && x <= 6 && y >= 1 && y <= 6;
        ink = frame || (bit && !markers[id][(y - 2) * 4 + x - 2]);
      }
      black_[(row * kCells + y) * layout_.columns * kCells + column * kCells + x] = ink;
    }
    if (!black) ++id;
    if (layout_.marker_mm <= 0.0) id = 0;
  }
}

Vector3d PrintedBoard::corner(int id) const {
  const Vector2d at = printed_from_ordered_ * (layout_.corner(id) + displaced_[id]);
  return {at.x(), at.y(), warp(at.x(), at.y())};
}

double PrintedBoard::warp(double x, double y) const { return Vector2d(x, y).dot(warp_ * Vector2d(x, y)); }

Vector2d PrintedBoard::displacement(const Vector2d& at) const {
  const int across = layout_.columns - 1, down = layout_.rows - 1;
  const double x = std::clamp(at.x() / layout_.square_mm + 0.5 * layout_.columns - 1.0, 0.0, across - 1.0);
  const double y = std::clamp(at.y() / layout_.square_mm + 0.5 * layout_.rows - 1.0, 0.0, down - 1.0);
  const int i = std::min(static_cast<int>(x), across - 2), j = std::min(static_cast<int>(y), down - 2);
  const double fx = x - i, fy = y - j;
  const Vector2d* d = &displaced_[j * across + i];
  return (1.0 - fy) * ((1.0 - fx) * d[0] + fx * d[1]) + fy * ((1.0 - fx) * d[across] + fx * d[across + 1]);
}

Vector2d PrintedBoard::ordered(const Vector2d& printed) const {
  const Vector2d straight = ordered_from_printed_ * printed;
  const Vector2d near =
      straight - displacement(straight);  // displacements change by 1e-3 of themselves in their length
  return straight - displacement(near);
}

bool PrintedBoard::is_black(int column, int row) const {
  const int columns = layout_.columns * kCells, rows = layout_.rows * kCells;
  return column >= 0 && row >= 0 && column < columns && row < rows && black_[row * columns + column] != 0;
}

/// `at`: mm from the upper or left edge of the squares.
PrintedBoard::Cover PrintedBoard::cover(double at, double sigma, int squares) const {
  const auto cell_of = [&](double t) {
    const int square = static_cast<int>(std::floor(t / layout_.square_mm));
    const double within = t - square * layout_.square_mm;
    int cell = 0;
    while (cell < kCells - 1 && within >= edges_[cell + 1]) ++cell;
    return square * kCells + cell;
  };
  const auto edge_of = [&](int cell) {
    const int square = static_cast<int>(std::floor(static_cast<double>(cell) / kCells));
    return square * layout_.square_mm + edges_[cell - square * kCells];
  };
  const double end = squares * layout_.square_mm + 0.5 * layout_.square_mm;
  Cover c;
  c.first = cell_of(std::clamp(at - kReach * sigma, -0.5 * layout_.square_mm, end));
  const int last = cell_of(std::clamp(at + kReach * sigma, -0.5 * layout_.square_mm, end));
  c.count = std::min(last - c.first + 1, Cover::kMax);
  double below = 0.0;
  for (int i = 0; i < c.count; ++i) {
    const double up_to = i + 1 == c.count ? 1.0 : gaussian_integral((edge_of(c.first + i + 1) - at) / sigma);
    c.share[i] = up_to - below;
    below = up_to;
  }
  return c;
}

PrintedBoard::Print PrintedBoard::print(const Vector2d& at, const Vector2d& sigma) const {
  const Vector2d on_layout = ordered(at);
  const Cover x = cover(on_layout.x() + 0.5 * layout_.columns * layout_.square_mm, std::hypot(sigma.x(), kInkSpread),
                        layout_.columns);
  const Cover y =
      cover(on_layout.y() + 0.5 * layout_.rows * layout_.square_mm, std::hypot(sigma.y(), kInkSpread), layout_.rows);
  double black = 0.0;
  const bool first = is_black(x.first, y.first);
  bool even = true;
  for (int j = 0; j < y.count; ++j) {
    for (int i = 0; i < x.count; ++i) {
      const bool cell = is_black(x.first + i, y.first + j);
      if (cell) black += x.share[i] * y.share[j];
      even = even && cell == first;
    }
  }
  const Vector3f white(0.84F, 0.835F, 0.81F), ink(0.045F, 0.045F, 0.048F);
  Vector3f colour = white + static_cast<float>(black) * (ink - white);
  for (const Spot& spot : dirt_) {
    const double edge = spot.edge + sigma.maxCoeff();
    const double inside = spot.radius + 0.5 * edge - (at - spot.centre).norm();
    if (inside > -kReach * sigma.maxCoeff()) even = false;
    if (inside <= 0.0) continue;
    colour *= static_cast<float>(1.0 - spot.darkness * std::min(1.0, inside / edge));
  }
  return {colour, even};
}

}  // namespace scanrig::sim
