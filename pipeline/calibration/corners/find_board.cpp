#include "pipeline/calibration/corners/find_board.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/statistics.h"
#include "pipeline/calibration/corners/board_seed.h"
#include "pipeline/calibration/corners/saddle_fit.h"

namespace scanrig {
namespace {

constexpr double kEdgeReach = 2.5;  // pixels from an edge that its blur reaches
constexpr int kMinPixels = 30;
constexpr int kRounds = 3;  // the markers place the first; what they add to a corner's place is gone after the last

enum class Loss { none, outside, glared, occluded, not_converged };

/// All corners of one image.
class CornerFinder {
 public:
  CornerFinder(const CornerImage& image, const Board& board, const BoardSeed& seed, const CornerOptions& options)
      : image_(image), board_(board), options_(options), map_(seed.map), parity_(seed.parity) {
    losses_.assign(static_cast<std::size_t>(board.corner_count()), Loss::not_converged);
  }

  /// Every corner, from the map of the corners fitted before, else from the seed's.
  void fit_all() {
    if (!saddles_.empty()) start_blur_px_ = median_of([](const Saddle& s) { return s.blur_px; });
    saddles_.clear();
    for (int id = 0; id < board_.corner_count(); ++id) losses_[static_cast<std::size_t>(id)] = fit(id);
  }
  void improve_map() {
    if (auto map = BoardMap::fit(points()); map && saddles_.size() >= 12) map_ = *map;
  }
  void drop_poor_fits();
  void drop_misfits();
  [[nodiscard]] BoardFinding finding() const;

 private:
  Loss fit(int id);
  [[nodiscard]] int reach_px() const { return static_cast<int>(std::ceil(options_.radius_px)); }
  [[nodiscard]] std::pair<std::vector<FitPixel>, int> patch(const Eigen::Vector2d& origin,
                                                            const Eigen::Vector2d& corner,
                                                            const Eigen::Matrix2d& board_from_pixel,
                                                            bool is_upper_left_white) const;
  [[nodiscard]] bool is_usable(const Eigen::Vector2d& from_corner, const Eigen::Matrix2d& board_from_pixel,
                               bool is_upper_left_white) const;
  [[nodiscard]] std::vector<BoardPoint> points() const;
  void drop(int id) {
    saddles_.erase(id);
    losses_[static_cast<std::size_t>(id)] = Loss::occluded;
  }
  [[nodiscard]] double median_of(double (*value)(const Saddle&)) const;
  [[nodiscard]] double saturated_share(const std::array<Eigen::Vector2d, 4>& outline) const;

  const CornerImage& image_;
  const Board& board_;
  const CornerOptions& options_;
  BoardMap map_;
  BoardParity parity_;
  double start_blur_px_ = Saddle{}.blur_px;
  std::map<int, Saddle> saddles_;  // by corner, ascending
  std::vector<Loss> losses_;
};

/// Whether only the two edges of this corner show in a pixel: nothing of a marker or of the next corners.
bool CornerFinder::is_usable(const Eigen::Vector2d& from_corner, const Eigen::Matrix2d& board_from_pixel,
                             bool is_upper_left_white) const {
  const double marker_starts =
      board_.markers ? 0.5 * (board_.square_mm - board_.markers->size_mm) : board_.square_mm;  // mm from the corner
  for (int i = 0; i < 8; ++i) {
    const double angle = i * 0.25 * std::numbers::pi;
    const Eigen::Vector2d place =
        board_from_pixel * (from_corner + kEdgeReach * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    const double far = place.cwiseAbs().maxCoeff();
    const double near = place.cwiseAbs().minCoeff();
    if (far > board_.square_mm) return false;
    if (near > marker_starts && (place.x() * place.y() > 0.0) == is_upper_left_white) return false;
  }
  return true;
}

/// Pixels around `origin` for a corner that is `corner` from there, and how many more of them are saturated.
std::pair<std::vector<FitPixel>, int> CornerFinder::patch(const Eigen::Vector2d& origin, const Eigen::Vector2d& corner,
                                                          const Eigen::Matrix2d& board_from_pixel,
                                                          bool is_upper_left_white) const {
  std::pair<std::vector<FitPixel>, int> found;
  const int reach = reach_px();
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const Eigen::Vector2d place(dx, dy);
      const Eigen::Vector2d from_corner = place - corner;
      if (from_corner.norm() > options_.radius_px || !is_usable(from_corner, board_from_pixel, is_upper_left_white))
        continue;
      const int x = static_cast<int>(origin.x()) + dx;
      const int y = static_cast<int>(origin.y()) + dy;
      if (image_.is_saturated(x, y)) {
        ++found.second;
      } else {
        found.first.push_back({place, image_.value(x, y), image_.colour(x, y)});
      }
    }
  }
  return found;
}

Loss CornerFinder::fit(int id) {
  const Eigen::Vector2d on_board = board_.corner(id).head<2>();
  const Eigen::Matrix2d jacobian = map_.jacobian(on_board);
  const Eigen::Vector2d seed = map_.pixel(on_board);
  if (!seed.allFinite() || !(std::abs(jacobian.determinant()) > 1e-9)) return Loss::not_converged;
  const Eigen::Matrix2d board_from_pixel = jacobian.inverse();
  const int column = id % board_.corner_columns();
  const bool is_white = is_white_square(column, id / board_.corner_columns(), parity_);
  Saddle saddle;
  saddle.place = seed;
  const std::array<Eigen::Vector2d, 2> expected = {jacobian.col(0).normalized(), jacobian.col(1).normalized()};
  saddle.directions = expected;
  saddle.blur_px = start_blur_px_;
  const int reach = reach_px();
  for (int round = 0; round < 3; ++round) {
    const Eigen::Vector2d origin(std::round(saddle.place.x()), std::round(saddle.place.y()));
    const int x0 = static_cast<int>(origin.x());
    const int y0 = static_cast<int>(origin.y());
    if (x0 < reach || y0 < reach || x0 >= image_.width() - reach || y0 >= image_.height() - reach) return Loss::outside;
    const auto [pixels, saturated] = patch(origin, saddle.place - origin, board_from_pixel, is_white);
    const auto all = static_cast<double>(pixels.size()) + saturated;
    if (saturated > options_.max_saturated * all) return Loss::glared;
    if (static_cast<int>(pixels.size()) < kMinPixels) return Loss::not_converged;
    Saddle start = saddle;
    start.place -= origin;
    const auto fitted = fit_saddle(pixels, image_.colours, start);
    if (!fitted) return Loss::not_converged;
    saddle = *fitted;
    saddle.place += origin;
    if (!((saddle.place - seed).norm() < options_.max_shift_px)) return Loss::not_converged;
    if ((saddle.place - origin - start.place).norm() < 0.5) break;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    if (saddle.directions[i].dot(expected[i]) < 0.94) return Loss::occluded;
  }
  if ((saddle.contrast > 0.0) != is_white) return Loss::occluded;
  saddle.contrast = std::abs(saddle.contrast);
  saddles_.emplace(id, saddle);
  return Loss::none;
}

std::vector<BoardPoint> CornerFinder::points() const {
  std::vector<BoardPoint> points;
  for (const auto& [id, saddle] : saddles_) points.push_back({board_.corner(id).head<2>(), saddle.place});
  return points;
}

double CornerFinder::median_of(double (*value)(const Saddle&)) const {
  std::vector<double> values;
  for (const auto& [id, saddle] : saddles_) values.push_back(value(saddle));
  return values.empty() ? 0.0 : quantile(values, 0.5);
}

void CornerFinder::drop_poor_fits() {
  const double residual = median_of([](const Saddle& s) { return s.noise / s.contrast; });
  const double contrast = median_of([](const Saddle& s) { return s.contrast; });
  std::vector<int> poor;
  for (const auto& [id, saddle] : saddles_) {
    const bool is_poor = saddle.noise / saddle.contrast > std::max(options_.max_residual, 3.0 * residual);
    if (is_poor || saddle.contrast < 0.3 * contrast) poor.push_back(id);
  }
  for (const int id : poor) drop(id);
}

void CornerFinder::drop_misfits() {
  for (int round = 0; round < 5 && saddles_.size() >= 16; ++round) {
    const auto map = BoardMap::fit(points());
    if (!map) return;
    std::vector<std::pair<double, int>> misfits;
    std::vector<double> sizes;
    for (const auto& [id, saddle] : saddles_) {
      misfits.emplace_back((map->pixel(board_.corner(id).head<2>()) - saddle.place).norm(), id);
      sizes.push_back(misfits.back().first);
    }
    const double limit = std::max(options_.max_misfit_px, 6.0 * quantile(sizes, 0.5) / 1.18);  // Rayleigh's median
    std::sort(misfits.rbegin(), misfits.rend());
    if (misfits.front().first <= limit) return;
    // The worst ones pull the map towards them: only those near the worst go in one round.
    for (const auto& [size, id] : misfits) {
      if (size > limit && size > 0.5 * misfits.front().first) drop(id);
    }
  }
}

double CornerFinder::saturated_share(const std::array<Eigen::Vector2d, 4>& outline) const {
  Eigen::Vector2d lower = outline[0];
  Eigen::Vector2d upper = outline[0];
  for (const Eigen::Vector2d& end : outline) {
    lower = lower.cwiseMin(end);
    upper = upper.cwiseMax(end);
  }
  const auto inside = [&](int x, int y) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d side = outline[(i + 1) % 4] - outline[i];
      const Eigen::Vector2d from = Eigen::Vector2d(x, y) - outline[i];
      if (side.x() * from.y() - side.y() * from.x() < 0.0) return false;
    }
    return true;
  };
  const auto first = [](double value) { return std::max(0, static_cast<int>(std::max(value, 0.0))); };
  const double last_x = std::min(image_.width() - 1.0, upper.x());
  const double last_y = std::min(image_.height() - 1.0, upper.y());
  int all = 0;
  int saturated = 0;
  for (int y = first(lower.y()); y <= last_y; y += 3) {  // odd: meets every colour of a mosaic
    for (int x = first(lower.x()); x <= last_x; x += 3) {
      if (!inside(x, y)) continue;
      ++all;
      if (image_.is_saturated(x, y)) ++saturated;
    }
  }
  return all > 0 ? static_cast<double>(saturated) / all : 0.0;
}

BoardFinding CornerFinder::finding() const {
  BoardFinding found;
  std::vector<double> sides;
  for (const auto& [id, saddle] : saddles_) {
    found.corners.push_back({id, saddle.place, saddle.blur_px});
    const Eigen::Matrix2d jacobian = map_.jacobian(board_.corner(id).head<2>());
    sides.push_back(std::min(jacobian.col(0).norm(), jacobian.col(1).norm()) * board_.square_mm);
  }
  for (const Loss loss : losses_) {
    found.lost.outside += loss == Loss::outside;
    found.lost.glared += loss == Loss::glared;
    found.lost.occluded += loss == Loss::occluded;
    found.lost.not_converged += loss == Loss::not_converged;
  }
  found.parity = parity_;
  found.pixel_from_board = map_.homography();
  const double columns = board_.columns;
  const double rows = board_.rows;
  found.outline = {map_.pixel(board_.at(0.0, 0.0)), map_.pixel(board_.at(columns, 0.0)),
                   map_.pixel(board_.at(columns, rows)), map_.pixel(board_.at(0.0, rows))};
  found.square_px = sides.empty() ? 0.0 : quantile(sides, 0.5);
  found.blur_px = median_of([](const Saddle& s) { return s.blur_px; });
  found.contrast = median_of([](const Saddle& s) { return s.contrast; });
  found.noise = median_of([](const Saddle& s) { return s.noise; });
  found.saturated_share = saturated_share(found.outline);
  return found;
}

}  // namespace

Result<BoardFinding> find_board(const cv::Mat& image, const std::string& pixel_format, const Board& board,
                                const CornerOptions& options) {
  if (auto good = check_board(board); !good) return pass_on(good);
  const auto prepared = make_corner_image(image, pixel_format);
  if (!prepared) return pass_on(prepared);
  const auto seed = board.markers ? seed_from_markers(*prepared, board) : seed_from_chessboard(*prepared, board);
  if (!seed) return pass_on(seed);
  CornerFinder finder(*prepared, board, *seed, options);
  for (int round = 0; round < kRounds; ++round) {
    finder.fit_all();
    finder.drop_poor_fits();
    if (round > 0) finder.drop_misfits();
    finder.improve_map();
  }
  BoardFinding found = finder.finding();
  if (static_cast<int>(found.corners.size()) < options.min_corners) {
    return fail(ErrorCode::not_found,
                "board: {} of {} corners usable, {} needed ({} outside, {} glared, {} occluded, {} not sharp); check "
                "light, focus and place of the board",
                found.corners.size(), board.corner_count(), options.min_corners, found.lost.outside, found.lost.glared,
                found.lost.occluded, found.lost.not_converged);
  }
  return found;
}

}  // namespace scanrig
