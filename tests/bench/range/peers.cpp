#include "tests/bench/range/peers.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "core/statistics.h"
#include "pipeline/range/view_builder.h"
#include "tests/bench/range/rendered_scan.h"

namespace scanrig::bench {
namespace {

constexpr int kRounds = 5;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Median seconds of `work`.
template <class Work>
double median_seconds(const Work& work) {
  std::vector<double> seconds;
  for (int round = 0; round < kRounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    work();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return quantile(std::move(seconds), 0.5);
}

/// Disparities of the left image, over all that the working volume allows. OpenCV leaves out the columns whose search
/// would leave the image, so the images are widened before.
nlohmann::json by_opencv(const cv::Mat1b& left, const cv::Mat1b& right, const Rectification& r, int mode,
                         const DisparityPair& truth) {
  constexpr int kBlock = 5;
  const int count = std::max(16, (r.max_disparity - r.min_disparity + 16) / 16 * 16);
  const int margin = std::max(std::abs(r.min_disparity), std::abs(r.min_disparity + count));
  cv::Mat1b a, b;
  cv::copyMakeBorder(left, a, 0, 0, margin, margin, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, b, 0, 0, margin, margin, cv::BORDER_REPLICATE);
  const auto matcher = cv::StereoSGBM::create(r.min_disparity, count, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock,
                                              1, 63, 10, 100, 2, mode);
  cv::Mat1s fixed;
  const double seconds = median_seconds([&] { matcher->compute(a, b, fixed); });
  DisparityPair pair = truth;
  fixed.colRange(margin, margin + left.cols).convertTo(pair.measured, CV_32F, 1.0 / 16.0);
  pair.measured.setTo(kNan, pair.measured < static_cast<float>(r.min_disparity));
  pair.sigma = cv::Mat1f(left.size(), 1.0F);  // it gives none
  DisparityFigures figures;
  figures.add(pair);
  nlohmann::json json = figures.json();
  json["seconds"] = seconds;
  return json;
}

}  // namespace

Result<nlohmann::json> measure_peers(const std::filesystem::path& folder) {
  const auto scan = open_rendered(folder);
  if (!scan) return pass_on(scan);
  const auto surface = SurfaceIndex::create(scan->truth.mesh);
  if (!surface) return pass_on(surface);
  const auto images = scan->scan.load_images(0, 0);
  if (!images) return pass_on(images);
  const Rectification& r = scan->rectification;
  const StereoImages stereo{images->left_pattern, images->right_pattern, images->left_plain, images->right_plain};
  Result<View> view = fail(ErrorCode::internal, "not matched");
  const double seconds = median_seconds([&] { view = make_view(r, stereo, images->angle_rad, images->index, {}, {}); });
  if (!view) return pass_on(view);
  const TrueView seen(scan->truth, *surface, scan->truth.poses[0], scan->truth.poses[0].angles_deg[0], every_point());
  const DisparityPair own = compare(view->range, *scan, seen);
  DisparityFigures figures;
  figures.add(own);

  nlohmann::json json;
  json["own"] = figures.json();
  json["own"]["seconds"] = seconds;
  json["object_px"] = cv::countNonZero(view->silhouettes.empty() ? own.truth == own.truth
                                                                 : view->silhouettes.front().outside_px < 0.0F);
  std::array<cv::Mat1b, 2> grey;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto made =
        i == 0 ? rectified_grey(r.left_map, images->left_pattern) : rectified_grey(r.right_map, images->right_pattern);
    if (!made) return pass_on(made);
    made->convertTo(grey[i], CV_8U);
  }
  json["sgbm_3way"] = by_opencv(grey[0], grey[1], r, cv::StereoSGBM::MODE_SGBM_3WAY, own);
  json["sgbm_hh4"] = by_opencv(grey[0], grey[1], r, cv::StereoSGBM::MODE_HH4, own);
  return json;
}

}  // namespace scanrig::bench
