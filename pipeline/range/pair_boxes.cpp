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

/// First of `count` columns that hold `columns` and end within the image.
int first_column(cv::Range columns, int count, int width) { return std::min(columns.start, width - count); }

}  // namespace

PairBoxes object_boxes(const RectifiedPair& pair, cv::Range rows) {
  const int width = pair.left.cols;
  const cv::Range left = object_columns(pair.left_object, rows, width);
  const cv::Range right = object_columns(pair.right_object, rows, width);
  const int wider = std::max(left.size(), right.size());
  return {{first_column(left, wider, width), rows.start, wider, rows.size()},
          {first_column(right, wider, width), rows.start, wider, rows.size()}};
}

}  // namespace scanrig
