#pragma once

#include <opencv2/core/mat.hpp>

#include "core/parallel_blocks.h"

namespace scanrig {

/// An image of one value, filled by all threads: what a large one costs is its first touch.
template <class Value>
cv::Mat_<Value> filled_image(cv::Size size, const Value& value) {
  cv::Mat_<Value> image(size);
  for_each_in_blocks(image.total(), [&](std::size_t i) { image.template ptr<Value>()[i] = value; });
  return image;
}

}  // namespace scanrig
