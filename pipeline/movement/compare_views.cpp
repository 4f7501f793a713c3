#include "pipeline/movement/compare_views.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "pipeline/movement/image_shift.h"

namespace scanrig {
namespace {

bool usable(const cv::Mat& image) { return !image.empty() && (image.type() == CV_8UC1 || image.type() == CV_8UC3); }

ViewChange compare(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options) {
  ViewChange change;
  auto [squares, together_px] = image_shift(before, after, options.shift);
  change.squares = static_cast<int>(squares.size());
  if (squares.size() < options.min_squares) {
    const double values = static_cast<double>(before.total()) * before.channels();
    change.changed = cv::norm(before, after, cv::NORM_L1) / values > options.max_grey_step ? 1.0 : 0.0;
  } else {
    std::ranges::sort(squares, std::ranges::greater(), &PatchShift::shift_px);
    change.shift_px = std::max(
        together_px, squares[std::max(options.min_squares - 1, squares.size() / options.squares_per_moved)].shift_px);
    const auto others = std::ranges::count_if(
        squares, [&](const auto& square) { return square.misfit_px > options.shift.max_misfit_px; });
    change.changed = static_cast<double>(others) / static_cast<double>(squares.size());
  }
  change.unmoved = change.shift_px <= options.max_shift_px && change.changed <= options.max_changed;
  return change;
}

}  // namespace

Result<ViewChange> compare_views(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options) {
  if (!usable(before) || before.type() != after.type()) {
    return fail(ErrorCode::invalid_input, "images to compare must both be of 8 bit, grey or BGR");
  }
  if (before.size() != after.size()) {
    return fail(ErrorCode::invalid_input, "images to compare have {}x{} and {}x{} pixels", before.cols, before.rows,
                after.cols, after.rows);
  }
  try {
    return compare(before, after, options);
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::internal, "comparing views: {}", e.what());
  }
}

}  // namespace scanrig
