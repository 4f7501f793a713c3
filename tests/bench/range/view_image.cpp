// bench_view_image OUT NAME=SCAN...: of the first view of each rendered scan photograph, depth, sigma and true error, a
// row each, for the documentation. OUT: a JPEG, written anew.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "tests/bench/range/rendered_scan.h"

namespace {

using scanrig::bench::MeasuredView;

constexpr int kSide = 260, kMargin = 4, kTitle = 22;  // px
constexpr float kSigmaMm = 0.15F, kErrorMm = 0.15F;   // ends of the colour scales
const cv::Scalar kWhite(255, 255, 255), kInk(40, 40, 40);

cv::Mat1b measured_in(const cv::Mat1f& values) {
  cv::Mat1b measured(values.size());
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) measured(y, x) = std::isfinite(values(y, x)) ? 255 : 0;
  }
  return measured;
}

/// The square around what is measured.
cv::Rect box_of(const cv::Mat1f& depth) {
  const cv::Rect box = cv::boundingRect(measured_in(depth));
  const int side = std::min({std::max(box.width, box.height) + 40, depth.cols, depth.rows});
  const int x = std::clamp(box.x + box.width / 2 - side / 2, 0, depth.cols - side);
  const int y = std::clamp(box.y + box.height / 2 - side / 2, 0, depth.rows - side);
  return {x, y, side, side};
}

/// Values from `low` to `high` in colours of `map`; white where there is none.
cv::Mat coloured(const cv::Mat1f& values, float low, float high, int map) {
  cv::Mat1b scaled(values.size());
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      const float t = (values(y, x) - low) / (high - low);
      scaled(y, x) = cv::saturate_cast<std::uint8_t>(255.0F * (std::isfinite(t) ? t : 0.0F));
    }
  }
  cv::Mat colour;
  cv::applyColorMap(scaled, colour, map);
  const cv::Mat1b measured = measured_in(values);
  colour.setTo(kWhite, measured == 0);
  return colour;
}

cv::Mat as_shown(const cv::Mat3b& linear) {
  cv::Mat light;
  linear.convertTo(light, CV_32F, 1.0 / 255.0);
  cv::pow(light, 1.0 / 2.2, light);
  light.convertTo(light, CV_8U, 255.0);
  return light;
}

cv::Mat tile(const cv::Mat& image, const std::string& text) {
  cv::Mat small, out(kSide + kTitle, kSide, CV_8UC3, kWhite);
  cv::resize(image, small, {kSide, kSide}, 0, 0, cv::INTER_AREA);
  small.copyTo(out(cv::Rect(0, 0, kSide, kSide)));
  cv::putText(out, text, {4, kSide + 16}, cv::FONT_HERSHEY_SIMPLEX, 0.45, kInk, 1, cv::LINE_AA);
  cv::copyMakeBorder(out, out, kMargin, 0, kMargin, 0, cv::BORDER_CONSTANT, kWhite);
  return out;
}

cv::Mat row_of(const std::string& name, const MeasuredView& view) {
  const cv::Rect box = box_of(view.depth_mm);
  const cv::Mat1f depth = view.depth_mm(box), sigma = view.sigma_mm(box), error = view.error_mm(box);
  double nearest = 0.0, farthest = 0.0;
  cv::minMaxLoc(depth, &nearest, &farthest, nullptr, nullptr, measured_in(depth));
  const std::array<cv::Mat, 4> tiles = {
      tile(as_shown(view.photograph(box)), name),
      tile(coloured(depth, static_cast<float>(farthest), static_cast<float>(nearest), cv::COLORMAP_VIRIDIS),
           fmt::format("depth, {:.0f} to {:.0f} mm", nearest, farthest)),
      tile(coloured(sigma, 0.0F, kSigmaMm, cv::COLORMAP_VIRIDIS), fmt::format("sigma, 0 to {:.2f} mm", kSigmaMm)),
      tile(coloured(error, -kErrorMm, kErrorMm, cv::COLORMAP_TWILIGHT_SHIFTED),
           fmt::format("true error, -{0:.2f} to {0:.2f} mm", kErrorMm))};
  cv::Mat row;
  cv::hconcat(tiles, row);
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: bench_view_image OUT NAME=SCAN...\n");
    return static_cast<int>(scanrig::ExitCode::usage);
  }
  std::vector<cv::Mat> rows;
  for (int i = 2; i < argc; ++i) {
    const std::string word = argv[i];
    const auto equals = word.find('=');
    if (equals == std::string::npos) {
      fmt::print(stderr, "bench_view_image: {}: a name is missing; write NAME=SCAN\n", word);
      return static_cast<int>(scanrig::ExitCode::usage);
    }
    const auto view = scanrig::bench::first_view(word.substr(equals + 1));
    if (!view) {
      fmt::print(stderr, "bench_view_image: {}\n", view.error().message);
      return static_cast<int>(scanrig::exit_code(view.error().code));
    }
    rows.push_back(row_of(word.substr(0, equals), *view));
  }
  cv::Mat picture;
  cv::vconcat(rows, picture);
  if (!cv::imwrite(argv[1], picture, {cv::IMWRITE_JPEG_QUALITY, 85})) {
    fmt::print(stderr, "bench_view_image: {}: cannot be written; name another file\n", argv[1]);
    return static_cast<int>(scanrig::ExitCode::disk);
  }
  return 0;
}
