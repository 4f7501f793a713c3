#include "sim/scene/board.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

#include "core/parallel.h"
#include "sim/scene/calibration_series.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr PrintErrors kPerfect = {.corner_mm = 0, .scale_sigma = 0, .aspect = 0, .shear = 0, .warp_mm = 0, .dirt = 0};

std::unique_ptr<CalibrationSeries> series_of(const SeriesOptions& options) {
  return CalibrationSeries::create(options).value();
}

/// The raw image without its colour filters' raster.
cv::Mat smooth_grey(const cv::Mat& raw, double sigma) {
  cv::Mat grey;
  raw.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, grey, {}, sigma);
  return grey;
}

struct Found {
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
};

Found find_markers(const cv::Mat& raw) {
  cv::Mat grey;
  cv::cvtColor(raw, grey, cv::COLOR_BayerBG2GRAY);  // OpenCV's name for RGGB
  Found found;
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)
  const cv::aruco::ArucoDetector detector(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_100));
  detector.detectMarkers(grey, found.corners, found.ids);
#else
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_100), found.corners, found.ids);
#endif
  return found;
}

TEST(Board, ShowsOpenCvsMarkersInOrder) {
  const auto series =
      series_of({.noise = false, .print = kPerfect, .exact_placements = true, .placements = {3}, .angles = 1});
  const Found found = find_markers(series->shoot(0).left);
  ASSERT_EQ(found.ids.size(), 54U);
  // By counting: white squares row after row, the first row begins with a black one. Pixels by OpenCV's own homography
  // of the four outermost corners.
  std::vector<cv::Point2f> ordered, seen;
  for (const int id : {0, 10, 77, 87}) {
    const int column = id % 11 + 1, row = id / 11 + 1;
    ordered.emplace_back(static_cast<float>(column), static_cast<float>(row));
    const Vector2d pixel = series->corner_pixel(series->pairs()[0], true, id);
    seen.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  const cv::Mat pixel_from_square = cv::getPerspectiveTransform(ordered, seen);
  for (std::size_t i = 0; i < found.ids.size(); ++i) {
    const int row = found.ids[i] / 6, column = 2 * (found.ids[i] % 6) + (row % 2 == 0 ? 1 : 0);
    // Upper left corner of the marker first: it is 2 mm inside its square.
    std::vector<cv::Point2f> at = {{static_cast<float>(column) + 0.2F, static_cast<float>(row) + 0.2F}};
    cv::perspectiveTransform(at, at, pixel_from_square);
    EXPECT_LT(cv::norm(found.corners[i][0] - at[0]), 2.0) << "marker " << found.ids[i];
  }
}

TEST(Board, WithoutMarkersIsAChessboardForOpenCv) {
  BoardLayout layout;
  layout.columns = 9, layout.rows = 6, layout.square_mm = 12.0, layout.marker_mm = 0.0;
  const auto series = series_of(
      {.noise = false, .board = layout, .print = kPerfect, .exact_placements = true, .placements = {3}, .angles = 1});
  cv::Mat grey;
  cv::cvtColor(series->shoot(0).right, grey, cv::COLOR_BayerBG2GRAY);
  std::vector<cv::Point2f> corners;
  EXPECT_TRUE(cv::findChessboardCorners(grey, {8, 5}, corners));
}

/// Places on the line through `at` along `way` (unit) where the image passes the middle between its ends.
double crossing(const cv::Mat& image, const Vector2d& at, const Vector2d& way) {
  constexpr double kReach = 4.5, kStep = 0.25;
  std::vector<double> values;
  for (double t = -kReach; t <= kReach; t += kStep) {
    cv::Mat one;
    cv::getRectSubPix(image, {1, 1}, cv::Point2d(at.x() + t * way.x(), at.y() + t * way.y()), one, CV_32F);
    values.push_back(one.at<float>(0));
  }
  const double middle = 0.5 * (values.front() + values.back());
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double a = values[i - 1] - middle, b = values[i] - middle;
    if (a * b <= 0.0 && a != b) return -kReach + kStep * (static_cast<double>(i) - 1.0 + a / (a - b));
  }
  return NAN;
}

/// The corner near `guess` as the intersection of two lines through the edges on both sides of it.
Vector2d fitted_corner(const cv::Mat& image, const Vector2d& guess, const Vector2d& along, const Vector2d& down) {
  Eigen::Matrix2d normals;
  Vector2d offsets;
  int line = 0;
  for (const Vector2d& way : {along, down}) {
    const Vector2d unit = way.normalized();
    const Vector2d across(-unit.y(), unit.x());
    // Crossings a + b s, at places s that are symmetric about 0.
    double sum = 0.0, slope = 0.0, squares = 0.0;
    int count = 0;
    for (double s = 5.5; s <= 9.0; s += 0.5) {
      for (const double side : {-1.0, 1.0}) {
        const double c = crossing(image, guess + side * s * unit, across);
        sum += c, slope += side * s * c, squares += s * s, ++count;
      }
    }
    const double a = sum / count, b = slope / squares;
    const Vector2d direction = (unit + b * across).normalized();
    normals.row(line) = Vector2d(-direction.y(), direction.x());
    offsets[line] = normals.row(line).dot(guess + a * across);
    ++line;
  }
  return normals.inverse() * offsets;
}

struct Deviation {
  double mean_x = 0.0, mean_y = 0.0, rms = 0.0;
  int corners = 0;
};

/// Fitted corners of a pair's left or right image against the truth.
Deviation deviation(CalibrationSeries& series, std::size_t index, bool left) {
  const StereoImages images = series.shoot(index);
  const cv::Mat image = smooth_grey(left ? images.left : images.right, 1.0);
  const SeriesPair& pair = series.pairs()[index];
  const int across = series.board().layout().corner_columns();
  Deviation d;
  for (int id = across + 1; id < series.board().layout().corner_count() - across - 1; ++id) {
    if (id % across == 0 || id % across == across - 1) continue;
    const Vector2d at = series.corner_pixel(pair, left, id);
    if (at.x() < 20.0 || at.y() < 20.0 || at.x() > image.cols - 21.0 || at.y() > image.rows - 21.0) continue;
    const Vector2d along = series.corner_pixel(pair, left, id + 1) - series.corner_pixel(pair, left, id - 1);
    const Vector2d down = series.corner_pixel(pair, left, id + across) - series.corner_pixel(pair, left, id - across);
    const Vector2d off = fitted_corner(image, at, along, down) - at;
    d.mean_x += off.x(), d.mean_y += off.y(), d.rms += off.squaredNorm(), ++d.corners;
  }
  d.mean_x /= d.corners, d.mean_y /= d.corners, d.rms = std::sqrt(d.rms / d.corners);
  return d;
}

TEST(Board, HasItsCornersWhereTheTruthProjectsThem) {
  // Everything at once: print errors, warp, lens residual, runout, tilted table top.
  const auto series =
      series_of({.rig = RigVariation{.seed = 5, .residual_px = 0.2, .runout_mm = 0.05, .top_tilt_deg = 0.2},
                 .noise = false,
                 .print = {.dirt = 0},
                 .placements = {1, 3, 4},
                 .angles = 3});
  for (const std::size_t index : {1U, 3U, 6U}) {
    for (const bool left : {true, false}) {
      const Deviation d = deviation(*series, index, left);
      EXPECT_GT(d.corners, 30) << index;
      RecordProperty("rms_px", std::to_string(d.rms));
      EXPECT_LT(d.rms, 0.02) << index;
      EXPECT_LT(std::hypot(d.mean_x, d.mean_y), 0.005) << index;
    }
  }
}

TEST(Board, IsPrintedWithTheErrorsAsked) {
  const BoardLayout layout;
  const auto corner = [&](const PrintErrors& errors, int id) { return PrintedBoard(layout, errors, 7).corner(id); };
  EXPECT_LT((corner(kPerfect, 0) - Vector3d(-50.0, -35.0, 0.0)).norm(), 1e-12);
  PrintErrors errors = kPerfect;
  errors.scale = 0.003;
  EXPECT_NEAR((corner(errors, 10) - corner(errors, 0)).norm(), 100.3, 1e-9);
  errors = kPerfect, errors.aspect = 1e-3;
  EXPECT_GT(std::abs((corner(errors, 10) - corner(errors, 0)).norm() - 100.0), 1e-3);
  errors = kPerfect, errors.shear = 1e-3;
  EXPECT_GT(
      std::abs((corner(errors, 87) - corner(errors, 0)).norm() - (corner(errors, 77) - corner(errors, 10)).norm()),
      1e-3);
  errors = kPerfect, errors.warp_mm = 0.1;
  double highest = 0.0;
  for (int id = 0; id < layout.corner_count(); ++id) highest = std::max(highest, std::abs(corner(errors, id).z()));
  EXPECT_GT(highest, 0.03);
  EXPECT_LT(highest, 0.1);
  errors = kPerfect, errors.corner_mm = 0.008;
  double squares = 0.0;
  for (int id = 0; id < layout.corner_count(); ++id)
    squares += (corner(errors, id) - corner(kPerfect, id)).squaredNorm();
  EXPECT_NEAR(std::sqrt(squares / 2.0 / layout.corner_count()), 0.008, 0.0012);
}

TEST(Board, ShowsDirtAndGlare) {
  const auto seen = [](const PrintErrors& print) {
    return smooth_grey(
        series_of({.image_scale = 0.5, .noise = false, .print = print, .exact_placements = true, .placements = {1}})
            ->shoot(2)
            .left,
        0.7);
  };
  PrintErrors dirty = kPerfect, glossy = kPerfect;
  dirty.dirt = 30, glossy.glare = 1.0;
  const cv::Mat clean = seen(kPerfect);
  double darker = 0.0, brighter = 0.0;
  cv::minMaxLoc(clean - seen(dirty), nullptr, &darker);
  cv::minMaxLoc(seen(glossy) - clean, nullptr, &brighter);
  EXPECT_GT(darker, 25.0);
  EXPECT_GT(brighter, 30.0);
}

TEST(Board, HasRealAlbedosAndLeavesTheTableBlue) {
  const auto series = series_of({.image_scale = 0.5,
                                 .noise = false,
                                 .print = kPerfect,
                                 .exact_placements = true,
                                 .placements = {7},
                                 .angles = 1});
  cv::Mat colour;
  cv::cvtColor(series->shoot(0).left, colour, cv::COLOR_BayerBG2BGR);
  // A black square beside the middle, a white margin, the table before the board.
  const auto at = [&](double x, double y) {
    const SeriesPair& pair = series->pairs()[0];
    const Vector2d p =
        pair.rig.left.project(rot_y(0.01745 * pair.true_deg) * pair.table_from_board * Vector3d(x, y, 0.0));
    return colour.at<cv::Vec3b>(cv::Point(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))));
  };
  const cv::Vec3b white = at(0.0, 46.5), black = at(5.0, 0.0), table = at(0.0, 65.0);
  EXPECT_GT(white[1], 120);
  EXPECT_LT(white[1], 235);
  EXPECT_NEAR(white[0], white[2], 0.1 * white[1]);
  EXPECT_LT(black[1], 25);
  EXPECT_GT(black[1], 4);
  EXPECT_GT(table[0], 3 * table[2]);
}

TEST(Board, RefusesWhatCannotBeMade) {
  const auto refused = [](BoardLayout layout) {
    const auto made = CalibrationSeries::create({.board = layout});
    return !made && made.error().code == ErrorCode::out_of_range;
  };
  EXPECT_TRUE(refused({.rows = 8}));
  EXPECT_TRUE(refused({.columns = 2}));
  EXPECT_TRUE(refused({.marker_mm = 10.0}));
  EXPECT_TRUE(refused({.square_mm = 20.0}));
  EXPECT_TRUE(refused({.columns = 17, .rows = 13, .square_mm = 6.0, .marker_mm = 4.0}));
  EXPECT_FALSE(refused({.columns = 8, .rows = 5, .square_mm = 15.0, .marker_mm = 11.0}));
}

}  // namespace
}  // namespace scanrig::sim
