#include "pipeline/silhouette/box_around.h"

#include <opencv2/imgproc.hpp>

namespace scanrig {

cv::Rect box_around(const cv::Mat1b& mask, int margin) {
  const cv::Rect box = mask.empty() ? cv::Rect() : cv::boundingRect(mask);
  if (box.empty()) return {};
  const cv::Rect grown(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin);
  return grown & cv::Rect({0, 0}, mask.size());
}

}  // namespace scanrig
