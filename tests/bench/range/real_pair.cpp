#include "tests/bench/range/real_pair.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/range/stereo.h"
#include "tests/bench/range/disparity_figures.h"
#include "tests/bench/range/row_field.h"
#include "tests/bench/real_data/d415_measure.h"

namespace scanrig::bench {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kScale = 4.0F;  // of the files' true disparities
constexpr int kDisparities = 64;
constexpr double kFocal = 900.0, kBaseline = 100.0;  // of no weight: disparities are compared

cv::Mat1f true_disparity(const std::filesystem::path& file) {
  const cv::Mat1b values = cv::imread(file, cv::IMREAD_GRAYSCALE);
  cv::Mat1f out;
  values.convertTo(out, CV_32F, 1.0 / static_cast<double>(kScale));
  out.setTo(kNan, values == 0);
  return out;
}

/// OpenCV's best: all eight directions. Left of the search margin it has nothing, so the images are widened.
cv::Mat1f by_opencv(const cv::Mat1f& left, const cv::Mat1f& right) {
  constexpr int kBlock = 3;
  const auto matcher = cv::StereoSGBM::create(0, kDisparities, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 63,
                                              10, 100, 2, cv::StereoSGBM::MODE_HH);
  cv::Mat a, b;
  cv::copyMakeBorder(left, a, 0, 0, kDisparities, 0, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, b, 0, 0, kDisparities, 0, cv::BORDER_REPLICATE);
  a.convertTo(a, CV_8U);
  b.convertTo(b, CV_8U);
  cv::Mat1s fixed;
  matcher->compute(a, b, fixed);
  cv::Mat1f out;
  fixed.colRange(kDisparities, fixed.cols).convertTo(out, CV_32F, 1.0 / 16.0);
  out.setTo(kNan, out < 0.0F);
  return out;
}

/// Pixels whose point the right image sees too.
cv::Mat1b seen_by_both(const cv::Mat1f& left, const cv::Mat1f& right) {
  cv::Mat1b seen(left.size(), std::uint8_t{0});
  for (int v = 0; v < left.rows; ++v) {
    for (int u = 0; u < left.cols; ++u) {
      if (std::isnan(left(v, u))) continue;
      const int there = static_cast<int>(std::lround(static_cast<float>(u) - left(v, u)));
      if (there >= 0 && std::abs(right(v, there) - left(v, u)) <= 1.0F) seen(v, u) = 255;
    }
  }
  return seen;
}

nlohmann::json figures_of(const DisparityPair& pair) {
  DisparityFigures figures;
  figures.add(pair);
  nlohmann::json json = figures.json();
  double wanted = 0.0, bad = 0.0, measured = 0.0, wrong = 0.0;
  for (int v = 0; v < pair.truth.rows; ++v) {
    for (int u = 0; u < pair.truth.cols; ++u) {
      if (pair.seen_by_all(v, u) == 0) continue;
      wanted += 1.0;
      const float error = std::abs(pair.measured(v, u) - pair.truth(v, u));
      if (!(error <= 1.0F)) bad += 1.0;
      if (!std::isnan(error)) measured += 1.0;
      if (error > 1.0F) wrong += 1.0;
    }
  }
  json["bad_1"] = bad / wanted;
  json["coverage"] = measured / wanted;
  json["bad_1_of_measured"] = wrong / measured;
  return json;
}

}  // namespace

cv::Mat1f with_moved_rows(const cv::Mat1f& image, double rows_px) {
  if (rows_px == 0.0) return image;
  cv::Mat1f u(image.size()), v(image.size()), out;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      u(y, x) = static_cast<float>(x);
      v(y, x) = static_cast<float>(y) - row_field(x, y, image.size(), rows_px);
    }
  }
  cv::remap(image, out, u, v, cv::INTER_LANCZOS4, cv::BORDER_REPLICATE);
  return out;
}

Result<nlohmann::json> measure_middlebury(const std::filesystem::path& folder, double rows_px) {
  const cv::Mat1b left = cv::imread(folder / "im2.png", cv::IMREAD_GRAYSCALE),
                  right = cv::imread(folder / "im6.png", cv::IMREAD_GRAYSCALE);
  const cv::Mat1f truth = true_disparity(folder / "disp2.png"), back = true_disparity(folder / "disp6.png");
  if (left.empty() || right.empty() || truth.empty() || back.empty()) {
    return fail(ErrorCode::not_found, "{} does not hold im2, im6, disp2 and disp6", folder.string());
  }
  RectifiedPair pair;
  left.convertTo(pair.left, CV_32F);
  right.convertTo(pair.right, CV_32F);
  pair.right = with_moved_rows(pair.right, rows_px);
  const double middle_u = (left.cols - 1) / 2.0, middle_v = (left.rows - 1) / 2.0;
  pair.left_projection = {Projection::Kind::pinhole, left.cols, left.rows, kFocal, kFocal, middle_u, middle_v};
  pair.right_cx = middle_u;
  pair.baseline_mm = kBaseline;
  pair.min_disparity = 0;
  pair.max_disparity = kDisparities;
  const auto start = std::chrono::steady_clock::now();
  const auto range = match_rectified(pair, {}, {});
  if (!range) return pass_on(range);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const cv::Mat1f disparity(cv::Mat(kFocal * kBaseline / range->depth));
  const cv::Mat1f sigma(cv::Mat(range->sigma.mul(kFocal * kBaseline / range->depth.mul(range->depth))));
  const cv::Mat1b seen = seen_by_both(truth, back);
  nlohmann::json json;
  json["ours"] = figures_of({disparity, sigma, truth, seen, {}});
  json["hh"] = figures_of({by_opencv(pair.left, pair.right), cv::Mat1f(left.size(), 0.25F), truth, seen, {}});
  json["seconds"] = seconds;
  return json;
}

Result<nlohmann::json> measure_sheet(const std::filesystem::path& folder, double rows_px) {
  const auto result = measure_d415(folder, [&](const cv::Mat1f& right) { return with_moved_rows(right, rows_px); });
  if (!result) return pass_on(result);
  return nlohmann::json{{"rms_px", result->ours.rms_px},
                        {"coverage", result->ours.coverage},
                        {"error_by_sigma", result->error_by_sigma},
                        {"rim_smeared_px", result->ours.rim_smeared_px},
                        {"rim_bridged_px", result->ours.rim_bridged_px},
                        {"rim_rays", result->rim_rays},
                        {"seconds", result->seconds}};
}

}  // namespace scanrig::bench
