#include "tests/bench/real_data/d415_measure.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/units.h"
#include "pipeline/range/stereo.h"

namespace scanrig::bench {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kFocal = 893.821, kBaseline = 55.0;
constexpr int kLowest = 16, kDisparities = 96;
const cv::Point kBowl(663, 387);  // of image0, px
constexpr int kBowlRadius = 62;

cv::Mat1b sheet_region(cv::Mat1b segmented) {
  cv::Mat1b sheet(segmented.size(), std::uint8_t{0});
  const std::vector<cv::Point> corners = {{310, 95}, {700, 12}, {960, 12}, {970, 690}, {240, 645}, {240, 240}};
  cv::fillPoly(sheet, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255));
  cv::circle(segmented, kBowl, kBowlRadius, cv::Scalar(1), cv::FILLED);
  cv::dilate(segmented, segmented, cv::Mat(), {-1, -1}, 20);
  sheet.setTo(0, segmented);
  return sheet;
}

Vector6 terms(int u, int v) {
  const double x = (u - 640) / 640.0, y = (v - 360) / 640.0;
  return Vector6(Vector6{1.0, x, y, x * x, x * y, y * y});
}

/// Fits the sheet, then again without pixels more than 1 px off.
Vector6 fit_sheet(const cv::Mat1f& disparity, const cv::Mat1b& sheet, D415Measure& measure) {
  Vector6 quadric = Vector6::Zero();
  for (const double limit : {1e9, 3.0, 1.0, 1.0}) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 rhs = Vector6::Zero();
    double squares = 0.0, used = 0.0;
    for (int v = 0; v < sheet.rows; ++v) {
      for (int u = 0; u < sheet.cols; ++u) {
        if (sheet(v, u) == 0 || std::isnan(disparity(v, u))) continue;
        const Vector6 f = terms(u, v);
        const double d = static_cast<double>(disparity(v, u)), off = d - f.dot(quadric);
        if (std::abs(off) > limit) continue;
        normal += f * f.transpose();
        rhs += f * d;
        squares += off * off;
        used += 1.0;
      }
    }
    quadric = normal.ldlt().solve(rhs);
    measure.rms_px = std::sqrt(squares / used);
    measure.coverage = used / cv::countNonZero(sheet);
  }
  return quadric;
}

using Profile = std::vector<double>;  // height over the sheet, px, by distance from the bowl's centre; NaN unmeasured

Profile profile(const cv::Mat1f& disparity, const Vector6& quadric, int ray) {
  Profile height;
  for (int r = 0; r <= 85; ++r) {
    const int u = static_cast<int>(std::lround(kBowl.x + r * std::cos(to_radians(3.0 * ray))));
    const int v = static_cast<int>(std::lround(kBowl.y + r * std::sin(to_radians(3.0 * ray))));
    height.push_back(static_cast<double>(disparity(v, u)) - terms(u, v).dot(quadric));
  }
  return height;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

constexpr std::size_t kWallInner = 46, kWallOuter = 56;  // px

/// Height of the bowl's wall, NaN where too little of it is measured.
double wall_height(const Profile& height) {
  std::vector<double> wall;
  for (std::size_t r = kWallInner; r <= kWallOuter; ++r) {
    if (std::isfinite(height[r])) wall.push_back(height[r]);
  }
  return wall.size() < 6 ? NAN : median(wall);
}

struct Rise {
  double smeared = 0.0;
  double bridged = NAN;
};

Rise rise(const Profile& height, double wall) {
  Rise out;
  double tenth = NAN, before = NAN, before_at = 0.0;
  for (std::size_t r = height.size() - 1; r >= kWallInner; --r) {
    const double h = height[r], at = static_cast<double>(r);
    if (!std::isfinite(h)) continue;
    const auto crossing = [&](double level) { return before_at + (at - before_at) * (level - before) / (h - before); };
    if (h < 0.1 * wall) {  // the sheet, or noise on it
      tenth = NAN;
      out.smeared = 0.0;
    } else if (std::isnan(tenth) && std::isfinite(before)) {
      tenth = crossing(0.1 * wall);
    }
    if (!std::isnan(tenth) && h >= 0.9 * wall) {
      out.bridged = tenth - crossing(0.9 * wall);
      return out;
    }
    if (!std::isnan(tenth)) out.smeared += 1.0;
    before = h;
    before_at = at;
  }
  return out;
}

/// Fills in rims, sheets and the number of rays.
void measure(const cv::Mat1f& ours, const cv::Mat1f& sgbm, const cv::Mat1b& sheet, D415Comparison& result) {
  const Vector6 our_quadric = fit_sheet(ours, sheet, result.ours), sgbm_quadric = fit_sheet(sgbm, sheet, result.sgbm);
  std::vector<double> our_smeared, our_bridged, sgbm_smeared, sgbm_bridged;
  for (int ray = 0; ray < 120; ++ray) {
    const Profile a = profile(ours, our_quadric, ray), b = profile(sgbm, sgbm_quadric, ray);
    const double our_wall = wall_height(a), sgbm_wall = wall_height(b);
    if (!(our_wall > 1.0) || !(sgbm_wall > 1.0)) continue;
    const Rise our_rise = rise(a, our_wall), sgbm_rise = rise(b, sgbm_wall);
    if (std::isnan(our_rise.bridged) || std::isnan(sgbm_rise.bridged)) continue;
    our_smeared.push_back(our_rise.smeared);
    our_bridged.push_back(our_rise.bridged);
    sgbm_smeared.push_back(sgbm_rise.smeared);
    sgbm_bridged.push_back(sgbm_rise.bridged);
  }
  result.rim_rays = static_cast<int>(our_smeared.size());
  result.ours.rim_smeared_px = median(our_smeared);
  result.ours.rim_bridged_px = median(our_bridged);
  result.sgbm.rim_smeared_px = median(sgbm_smeared);
  result.sgbm.rim_bridged_px = median(sgbm_bridged);
}

double sigmas_off(const cv::Mat1f& disparity, const cv::Mat1f& sigma, const cv::Mat1b& sheet) {
  D415Measure ignored;
  const Vector6 quadric = fit_sheet(disparity, sheet, ignored);
  std::vector<double> ratios;
  for (int v = 0; v < sheet.rows; ++v) {
    for (int u = 0; u < sheet.cols; ++u) {
      if (sheet(v, u) == 0 || std::isnan(disparity(v, u))) continue;
      const double off = static_cast<double>(disparity(v, u)) - terms(u, v).dot(quadric);
      ratios.push_back(std::abs(off) / static_cast<double>(sigma(v, u)));
    }
  }
  constexpr double kNormal = 0.6745;
  return median(ratios) / kNormal;
}

cv::Mat1f plain_sgbm(const cv::Mat1b& left, const cv::Mat1b& right) {
  const auto matcher = cv::StereoSGBM::create(kLowest, kDisparities, 9, 8 * 81, 32 * 81, 1, 63, 5, 100, 2,
                                              cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat1b bright_left, bright_right;
  left.convertTo(bright_left, CV_8U, 3.0);
  right.convertTo(bright_right, CV_8U, 3.0);
  cv::Mat1s fixed;
  matcher->compute(bright_left, bright_right, fixed);
  cv::Mat1f disparity;
  fixed.convertTo(disparity, CV_32F, 1.0 / 16.0);
  disparity.setTo(NAN, fixed < kLowest * 16);
  return disparity;
}

}  // namespace

Result<D415Comparison> measure_d415(const std::filesystem::path& folder,
                                    const std::function<cv::Mat1f(const cv::Mat1f&)>& change_right) {
  const cv::Mat1b left = cv::imread(folder / "image0.png", cv::IMREAD_GRAYSCALE);
  const cv::Mat1b right = cv::imread(folder / "image1.png", cv::IMREAD_GRAYSCALE);
  constexpr int kHeader = 128;  // bytes before the data of a small .npy file
  std::ifstream npy(folder / "real_segment_image_0.npy", std::ios::binary);
  cv::Mat1b segmented(720, 1280);
  npy.seekg(kHeader);
  npy.read(reinterpret_cast<char*>(segmented.data), std::streamsize(segmented.total()));
  if (left.size() != segmented.size() || right.size() != segmented.size() || !npy) {
    return fail(ErrorCode::not_found, "d415: {} does not hold the pair and its segmentation", folder.string());
  }
  RectifiedPair pair;
  left.convertTo(pair.left, CV_32F);
  right.convertTo(pair.right, CV_32F);
  if (change_right) pair.right = change_right(pair.right);
  pair.left_projection = {Projection::Kind::pinhole, 1280, 720, kFocal, kFocal, 633.127, 354.453};
  pair.right_cx = pair.left_projection.cx;
  pair.baseline_mm = kBaseline;
  pair.min_disparity = kLowest;
  pair.max_disparity = kLowest + kDisparities;
  const auto start = std::chrono::steady_clock::now();
  const auto range = match_rectified(pair, {}, {});
  if (!range) return pass_on(range);
  D415Comparison result;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const cv::Mat1f disparity(cv::Mat(kFocal * kBaseline / range->depth));
  const cv::Mat1f sigma(cv::Mat(range->sigma.mul(kFocal * kBaseline / range->depth.mul(range->depth))));
  const cv::Mat1b sheet = sheet_region(segmented);
  measure(disparity, plain_sgbm(left, right), sheet, result);
  result.error_by_sigma = sigmas_off(disparity, sigma, sheet);
  return result;
}

}  // namespace scanrig::bench
