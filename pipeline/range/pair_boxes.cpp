#include "pipeline/range/pair_boxes.h"

#include <algorithm>

#include "pipeline/silhouette/box_around.h"

namespace scanrig {
namespace {

/// The columns that show the object, and some around.
cv::Range object_columns(const cv::Mat1b& mask, cv::Range rows, int width) {
  constexpr int kMargin = 32;  // more than the windows that flatten, aggregate and match
  if (mask.empty()) return {0, width};
  const cv::Rect box = box_around(mask.rowRange(rows), kMargin);
  return {box.x, box.x + box.width};
}

/// The same columns and their neighbours, so many.
int first_of_wider(cv::Range columns, int wanted, int width) { return std::min(columns.start, width - wanted); }

}  // namespace

PairBoxes object_boxes(const RectifiedPair& pair, cv::Range rows) {
  const int width = pair.left.cols;
  const cv::Range left = object_columns(pair.left_object, rows, width);
  const cv::Range right = object_columns(pair.right_object, rows, width);
  const int wider = std::max(left.size(), right.size());
  return {{first_of_wider(left, wider, width), rows.start, wider, rows.size()},
          {first_of_wider(right, wider, width), rows.start, wider, rows.size()}};
}

}  // namespace scanrig
