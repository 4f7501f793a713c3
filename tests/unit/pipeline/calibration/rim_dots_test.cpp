#include "pipeline/calibration/corners/rim_dots.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "tests/unit/pipeline/calibration/board_renderer.h"

namespace scanrig::testing {
namespace {

/// A blue table with lighter dots, each a little off its even place.
struct Table {
  RimDots dots{40, 84.5, 2.4};
  std::vector<double> angles;
  TestCamera camera;
  Exposure exposure;
  double table_angle = 0.3;

  explicit Table(double off_by = 0.125) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> off(-off_by, off_by);
    for (int i = 0; i < dots.count; ++i) angles.push_back(2.0 * std::numbers::pi * (i + off(random)) / dots.count);
    exposure.white = 250.0;
    for (double& gain : exposure.gains) gain = 1.0;
  }

  [[nodiscard]] Eigen::Vector3d place(int id) const {
    const double angle = table_angle + angles[static_cast<std::size_t>(id)];
    return {dots.radius_mm * std::sin(angle), 0.0, dots.radius_mm * std::cos(angle)};
  }
  [[nodiscard]] Eigen::Vector2d truth(int id) const { return camera.project(camera_from_table() * place(id)); }

  [[nodiscard]] cv::Mat image() const {
    const auto distance = [this](const Eigen::Vector2d& p) {  // to the rim of the nearest dot, inside negative
      double nearest = 1e9;
      for (int id = 0; id < dots.count; ++id) {
        const Eigen::Vector3d dot = place(id);
        nearest = std::min(nearest, (p - Eigen::Vector2d(dot.x(), dot.z())).norm() - 0.5 * dots.diameter_mm);
      }
      return nearest;
    };
    Print print;
    print.albedo = [=](const Eigen::Vector2d& p) { return distance(p) < 0.0 ? 1.0 : 0.0; };
    print.distance_to_edge = [=](const Eigen::Vector2d& p) {
      const double from_ring = std::abs(p.norm() - 84.5) - 10.0;
      return from_ring > 0.0 ? from_ring : std::abs(distance(p));
    };
    Eigen::Isometry3d table_from_print = Eigen::Isometry3d::Identity();
    table_from_print.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // its x and y are the table's X and Z
    const auto colours = [](double share, int channel) {
      constexpr double table[] = {0.035, 0.085, 0.46};
      constexpr double dot[] = {0.08, 0.16, 0.60};
      return table[channel] + share * (dot[channel] - table[channel]);
    };
    return render(print, camera, camera_from_table() * table_from_print, exposure, colours);
  }

  [[nodiscard]] Camera known_camera(double off_px = 0.0) const {
    Camera known;
    known.projection = {Projection::Kind::pinhole, camera.width,      camera.height, camera.f, camera.f,
                        camera.cx + off_px,        camera.cy - off_px};
    std::copy(std::begin(camera.distortion), std::end(camera.distortion), known.distortion.begin());
    known.camera_from_turntable = camera_from_table();
    return known;
  }
};

struct DotErrors {
  Eigen::Vector2d sum{0.0, 0.0};
  Eigen::Vector2d squares{0.0, 0.0};
  double worst = 0.0;
  int count = 0;

  void add(const RimDotFinding& found, const Table& table) {
    for (const DotObservation& dot : found.dots) {
      const Eigen::Vector2d error = dot.pixel - table.truth(dot.id);
      sum += error;
      squares += error.cwiseAbs2();
      worst = std::max(worst, error.norm());
      ++count;
    }
  }
  [[nodiscard]] Eigen::Vector2d sigma() const { return (squares / count).cwiseSqrt(); }
  [[nodiscard]] Eigen::Vector2d mean() const { return sum / count; }
  void print(const char* name) const {
    std::cout << name << ": sigma " << sigma().transpose() << " px, mean " << mean().transpose() << ", worst " << worst
              << ", " << count << " dots\n";
  }
};

TEST(RimDots, AreMeasuredFromAnApproximateCamera) {
  Table table;
  RimDotOptions options;
  options.angles_rad = table.angles;
  DotErrors errors;
  for (int i = 0; i < 4; ++i) {
    table.table_angle = 0.3 + 0.785 * i;
    table.exposure.seed = 40 + static_cast<std::uint64_t>(i);
    const cv::Mat image = table.image();
    const auto start = std::chrono::steady_clock::now();
    const auto found =
        find_rim_dots(image, "BayerRG8", table.known_camera(2.0), table.dots, table.table_angle, options);
    if (i == 0) {
      std::cout << "rim dots: " << std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()
                << " s\n";
    }
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->dots.size() + static_cast<std::size_t>(found->outside), 40u);
    errors.add(*found, table);
  }
  errors.print("rim dots");
  EXPECT_LT(errors.sigma().maxCoeff(), 0.044);  // noise alone: 0.039 x 0.019
  EXPECT_LT(errors.sigma().minCoeff(), 0.024);
  EXPECT_LT(errors.mean().cwiseAbs().maxCoeff(), 0.008);  // its own sigma is 0.004
}

TEST(RimDots, AreFoundWhenThePrintedPlacesAreNotKnownYet) {
  const Table table;
  RimDotOptions options;
  options.search_along_mm = 2.5;
  const auto found =
      find_rim_dots(table.image(), "BayerRG8", table.known_camera(2.0), table.dots, table.table_angle, options);
  ASSERT_TRUE(found);
  DotErrors errors;
  errors.add(*found, table);
  errors.print("unknown places");
  EXPECT_GE(errors.count, 30);  // all that are in the image
  EXPECT_EQ(found->unclear, 0);
  EXPECT_LT(errors.worst, 0.16);
}

TEST(RimDots, LargeOnesHaveNoEccentricity) {
  Table table(0.0);
  table.dots = {12, 80.0, 10.0};
  table.exposure.read_noise = 0.2;
  table.exposure.shot_noise_variance = 0.0;
  table.angles.clear();
  for (int i = 0; i < 12; ++i) table.angles.push_back(2.0 * std::numbers::pi * i / 12.0);
  const auto found = find_rim_dots(table.image(), "BayerRG8", table.known_camera(), table.dots, table.table_angle);
  ASSERT_TRUE(found);
  DotErrors errors;
  errors.add(*found, table);
  errors.print("10 mm dots");
  EXPECT_EQ(errors.count, 12 - found->outside);
  EXPECT_LT(errors.mean().cwiseAbs().maxCoeff(), 0.006);  // a centroid is off by 0.09
}

TEST(RimDots, LeavesOutThoseThatAreHidden) {
  const Table table;
  cv::Mat image = table.image();
  RimDotOptions options;
  options.angles_rad = table.angles;
  const std::vector<Eigen::Vector2d> board = {{60.0, 300.0}, {500.0, 300.0}, {500.0, 760.0}, {60.0, 760.0}};
  options.hidden_by.push_back(board);
  image(cv::Rect(700, 200, 250, 380)) = 128;                      // an object that no outline is given for
  cv::circle(image, {860, 470}, 40, cv::Scalar(30), cv::FILLED);  // with a texture
  cv::circle(image, {760, 350}, 30, cv::Scalar(200), cv::FILLED);
  const auto found = find_rim_dots(image, "BayerRG8", table.known_camera(), table.dots, table.table_angle, options);
  ASSERT_TRUE(found);
  EXPECT_GT(found->hidden, 3);
  EXPECT_GT(found->unclear, 2);
  DotErrors errors;
  errors.add(*found, table);
  errors.print("partly hidden");
  EXPECT_LT(errors.worst, 0.16);
  EXPECT_GT(errors.count, 15);
  for (const DotObservation& dot : found->dots) {
    const bool is_behind_board =
        dot.pixel.x() > 60.0 && dot.pixel.x() < 500.0 && dot.pixel.y() > 300.0 && dot.pixel.y() < 760.0;
    EXPECT_FALSE(is_behind_board) << dot.id;
  }
}

TEST(RimDots, FailsWithAReason) {
  const Table table;
  const cv::Mat image(960, 1280, CV_8UC1, cv::Scalar(80));
  const Camera camera = table.known_camera();
  EXPECT_EQ(find_rim_dots(image, "BayerRG8", camera, {}, 0.0).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(find_rim_dots(image, "BGR8", camera, table.dots, 0.0).error().code, ErrorCode::invalid_input);
  RimDotOptions options;
  options.angles_rad = {0.0};
  EXPECT_EQ(find_rim_dots(image, "BayerRG8", camera, table.dots, 0.0, options).error().code, ErrorCode::invalid_input);
  EXPECT_TRUE(find_rim_dots(image, "BayerRG8", camera, table.dots, 0.0)->dots.empty());
}

}  // namespace
}  // namespace scanrig::testing
