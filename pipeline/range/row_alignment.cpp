#include "pipeline/range/row_alignment.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/parallel.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/spline.h"

namespace scanrig {
namespace {

constexpr int kRounds = 3;
constexpr double kSettledPx = 0.02;

/// The right image and its mask with their rows moved by a field.
void move_rows(RectifiedPair& pair, const RectifiedPair& original, const RowField& field) {
  const cv::Mat1f c = spline_coefficients(original.right);
  const cv::Size size = c.size();
  pair.right = cv::Mat1f(size);
  if (!original.right_object.empty()) pair.right_object = cv::Mat1b(size);
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      const double at = std::clamp(v + field.at(u, v, size), 1.0, size.height - 3.001);
      const int below = static_cast<int>(at);
      const auto weights = spline_weights(static_cast<float>(at - below));
      const int west = std::max(u - 1, 0), east = std::min(u + 1, size.width - 1);
      float value = 0.0F;
      for (int j = 0; j < 4; ++j) {
        const float* line = c[below + j - 1];
        value += weights[static_cast<std::size_t>(j)] * (line[west] + 4.0F * line[u] + line[east]) / 6.0F;
      }
      pair.right(v, u) = value;
      if (!original.right_object.empty()) {
        pair.right_object(v, u) = original.right_object(static_cast<int>(std::lround(at)), u);
      }
    }
  });
}

/// Coarse disparities of the left image that the right one's confirm.
cv::Mat1f confirmed_left(const CoarseDisparity& coarse) {
  return confirmed(coarse.left, coarse.right, -1.0F, StereoOptions{}.coarse_left_right_px);
}

RowOffsets measure(const RectifiedPair& pair, const CoarseDisparity& coarse, const RowField& field,
                   const RowAlignmentOptions& options) {
  cv::Mat1f disparity = confirmed_left(coarse);
  if (!pair.left_object.empty()) disparity.setTo(kUnmeasured, pair.left_object == 0);
  cv::Mat1f sigma(disparity.size(), kUnmeasured);
  sigma.setTo(0.0F, disparity == disparity);  // false for NaN, unlike !=, whose meaning differs by processor
  RowOffsetOptions windows;
  windows.is_coarse = true;
  windows.max_offset_px = 1.5;
  const double known = cv::countNonZero(sigma == sigma);
  windows.stride_px = std::max(windows.stride_px, static_cast<int>(std::sqrt(known / options.max_windows)));
  return find_row_offsets(pair, disparity, sigma, windows, field);
}

/// The best textured window of each cell.
std::vector<cv::Point> textured_places(const RectifiedPair& pair, const RowAlignmentOptions& options) {
  const int radius = options.search_radius_px, reach = radius + options.search_rows_px;
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  cv::Mat1f mean, square, inside(pair.left.size(), 1.0F);
  cv::boxFilter(pair.left, mean, CV_32F, window);
  cv::boxFilter(pair.left.mul(pair.left), square, CV_32F, window);
  if (!pair.left_object.empty()) pair.left_object.convertTo(inside, CV_32F, 1.0 / 255.0);
  cv::boxFilter(inside, inside, CV_32F, window);
  cv::Mat1f texture(cv::Mat(square - mean.mul(mean)));
  texture.setTo(0.0F, inside < 0.9F);
  std::vector<cv::Point> places;
  const cv::Size size = texture.size();
  for (int j = 0; j < options.search_cells; ++j) {
    for (int i = 0; i < options.search_cells; ++i) {
      const cv::Rect cell(
          cv::Point(i * size.width / options.search_cells, j * size.height / options.search_cells),
          cv::Point((i + 1) * size.width / options.search_cells, (j + 1) * size.height / options.search_cells));
      const cv::Rect whole = cell & cv::Rect(radius, reach, size.width - 2 * radius, size.height - 2 * reach);
      if (whole.empty()) continue;
      double most = 0.0;
      cv::Point at;
      cv::minMaxLoc(texture(whole), nullptr, &most, nullptr, &at);
      if (most > 1.0) places.push_back(at + whole.tl());
    }
  }
  return places;
}

/// Where the right image shows the window around a place, rows apart included; a sigma of 0 where that is not clear.
RowSample search_window(const RectifiedPair& pair, cv::Point at, const RowAlignmentOptions& options) {
  const int radius = options.search_radius_px, side = 2 * radius + 1;
  const cv::Rect strip =
      cv::Rect(cv::Point(at.x - pair.max_disparity - radius, at.y - options.search_rows_px - radius),
               cv::Point(at.x - pair.min_disparity + radius + 1, at.y + options.search_rows_px + radius + 1)) &
      cv::Rect(0, 0, pair.right.cols, pair.right.rows);
  if (strip.width < side || strip.height != side + 2 * options.search_rows_px) return {};
  cv::Mat1f scores;
  cv::matchTemplate(pair.right(strip), pair.left(cv::Rect(at.x - radius, at.y - radius, side, side)), scores,
                    cv::TM_CCOEFF_NORMED);
  double best = 0.0, second = 0.0;
  cv::Point peak;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &peak);
  if (peak.y == 0 || peak.y + 1 == scores.rows) return {};
  const float above = scores(peak.y - 1, peak.x), here = scores(peak), below = scores(peak.y + 1, peak.x);
  const float bend = 2.0F * here - above - below;
  constexpr int kPeakPx = 4;
  cv::rectangle(scores, peak - cv::Point(kPeakPx, kPeakPx), peak + cv::Point(kPeakPx, kPeakPx), cv::Scalar(-1.0),
                cv::FILLED);
  cv::minMaxLoc(scores, nullptr, &second);
  if (best < 0.4 || 1.0 - best > 0.6 * (1.0 - second) || !(bend > 0.0F)) return {};
  RowSample sample;
  sample.u = static_cast<float>(at.x);
  sample.v = static_cast<float>(at.y);
  sample.u_right = static_cast<float>(strip.x + peak.x + radius);
  sample.offset = static_cast<float>(peak.y - options.search_rows_px) + 0.5F * (below - above) / bend;
  sample.sigma = 0.1F;
  return sample;
}

/// Rows so far apart that coarse matching fails.
RowOffsets search(const RectifiedPair& pair, const RowAlignmentOptions& options) {
  const std::vector<cv::Point> places = textured_places(pair, options);
  std::vector<RowSample> found(places.size());
  parallel_for(places.size(), [&](std::size_t i) { found[i] = search_window(pair, places[i], options); });
  std::erase_if(found, [](const RowSample& sample) { return sample.sigma == 0.0F; });
  RowOffsetOptions windows;
  windows.min_windows = 12;
  return fit_row_offsets(found, pair.left.size(), windows);
}

}  // namespace

Result<RowField> align_rows(RectifiedPair& pair, CoarseDisparity& coarse, const PairBoxes& boxes,
                            const RowAlignmentOptions& options) {
  const RectifiedPair original = pair;
  RowField field;
  for (int round = 0; round < kRounds; ++round) {
    RowOffsets offsets = measure(pair, coarse, field, options);
    bool is_found = offsets.windows > 0 && offsets.explained >= options.min_explained;
    if (!is_found && round == 0) {
      offsets = search(original, options);
      is_found = offsets.windows > 0 && offsets.explained >= options.search_explained;
    }
    if (!is_found) break;
    if (offsets.largest_px > options.max_px) {
      return fail(ErrorCode::refused,
                  "calibration: rows of the right camera's image are {:.1f} px from where it has them; calibrate the "
                  "cameras again",
                  offsets.largest_px);
    }
    double change = 0.0;
    for (const RowOffset& cell : offsets.cells) {
      const cv::Size size = pair.left.size();
      change =
          std::max(change, std::abs(offsets.right_field.at(cell.u, cell.v, size) - field.at(cell.u, cell.v, size)));
    }
    if (offsets.largest_px < options.min_px || (round > 0 && change < kSettledPx)) break;
    field = offsets.right_field;
    move_rows(pair, original, field);
    if (offsets.largest_px > options.again_px && round == 0) {
      coarse = coarse_disparity(pair, boxes);
    }
  }
  return field;
}

}  // namespace scanrig
