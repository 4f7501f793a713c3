#include "pipeline/range/pair_fit.h"

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "pipeline/range/rectification.h"
#include "pipeline/range/stereo.h"

namespace scanrig {
namespace {

/// The matched range image; without a depth where nothing matches.
Result<RangeImage> match_whole(const Rectification& frames, const cv::Mat& left, const cv::Mat& right,
                               const Context& context) {
  StereoOptions any_rows;
  any_rows.max_rows_px = std::numeric_limits<double>::infinity();
  auto range = match_stereo(frames, left, right, {}, {}, any_rows, context);
  if (!range && range.error().code == ErrorCode::degenerate) return RangeImage{};
  return range;
}

double matched_share(const RangeImage& range) {
  if (range.depth.empty()) return 0.0;
  return cv::countNonZero(range.depth == range.depth) / static_cast<double>(range.depth.total());
}

double rows_rms(const RowOffsets& rows) {
  double sum = 0.0;
  for (const RowOffset& cell : rows.cells) sum += cell.offset_px * cell.offset_px;
  if (rows.cells.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt(sum / static_cast<double>(rows.cells.size()));
}

}  // namespace

Result<PairFit> fit_pair(const Calibration& calibration, const cv::Mat& left, const cv::Mat& right,
                         const Context& context) {
  const auto frames = rectify(calibration);
  if (!frames) return pass_on(frames);
  const auto as_named = match_whole(*frames, left, right, context);
  if (!as_named) return pass_on(as_named);
  const auto exchanged = match_whole(*frames, right, left, context);
  if (!exchanged) return pass_on(exchanged);
  return PairFit{matched_share(*as_named), matched_share(*exchanged), rows_rms(as_named->row_offsets)};
}

}  // namespace scanrig
