#include "pipeline/closure/compare_views.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

namespace scanrig {
namespace {

constexpr int kMostFeatures = 400;
constexpr int kFewestFeatures = 12;       ///< fewer do not speak for the scene
constexpr double kFeatureQuality = 0.02;  ///< of the best corner
constexpr double kFeatureDistance = 5.0;  ///< px
constexpr double kWayBack = 0.5;          ///< px: who does not find back was on something else
const cv::Size kWindow(15, 15);
constexpr int kLevels = 3;

cv::Mat grey(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat result;
  cv::cvtColor(image, result, cv::COLOR_BGR2GRAY);
  return result;
}

bool usable(const cv::Mat& image) { return !image.empty() && (image.type() == CV_8UC1 || image.type() == CV_8UC3); }

double distance(const cv::Point2f& a, const cv::Point2f& b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// How far each feature moved that is found again.
std::vector<double> follow(const cv::Mat& before, const cv::Mat& after, const std::vector<cv::Point2f>& features) {
  std::vector<cv::Point2f> there, back;
  std::vector<unsigned char> found, found_back;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(before, after, features, there, found, error, kWindow, kLevels);
  cv::calcOpticalFlowPyrLK(after, before, there, back, found_back, error, kWindow, kLevels);
  std::vector<double> shifts;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (found[i] && found_back[i] && distance(features[i], back[i]) < kWayBack) {
      shifts.push_back(distance(features[i], there[i]));
    }
  }
  return shifts;
}

ViewChange compare(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options) {
  ViewChange change;
  std::vector<cv::Point2f> features;
  cv::goodFeaturesToTrack(before, features, kMostFeatures, kFeatureQuality, kFeatureDistance);
  change.features = static_cast<int>(features.size());
  if (change.features < kFewestFeatures) {
    const double step = cv::norm(before, after, cv::NORM_L1) / static_cast<double>(before.total());
    change.changed = step > options.most_grey_step ? 1.0 : 0.0;
  } else {
    auto shifts = follow(before, after, features);
    change.changed = 1.0 - static_cast<double>(shifts.size()) / static_cast<double>(features.size());
    if (!shifts.empty()) {
      const auto four_fifths = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() * 4 / 5);
      std::nth_element(shifts.begin(), four_fifths, shifts.end());
      change.shift_px = *four_fifths;
    }
  }
  change.unmoved = change.shift_px <= options.most_shift_px && change.changed <= options.most_changed;
  return change;
}

}  // namespace

Result<ViewChange> compare_views(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options) {
  if (!usable(before) || !usable(after)) {
    return fail(ErrorCode::invalid_input, "images to compare must be of 8 bit, grey or BGR");
  }
  if (before.size() != after.size()) {
    return fail(ErrorCode::invalid_input, "images to compare have {}x{} and {}x{} pixels", before.cols, before.rows,
                after.cols, after.rows);
  }
  try {
    return compare(grey(before), grey(after), options);
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::internal, "comparing views: {}", e.what());
  }
}

}  // namespace scanrig
