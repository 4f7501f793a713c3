#pragma once

#include <cstddef>
#include <opencv2/core/types.hpp>

#include "pipeline/range/range_image.h"

namespace scanrig {

inline constexpr int kCropRoomPx = 32;   ///< around the outline: farther out only "outside" matters
inline constexpr int kCropAlignPx = 16;  ///< the levels of a pyramid and sparse grids keep their pixels

/// Keeps of a view's images the object and some room around it: 10 to 30 % of the sensor. Everything cropped off is
/// background (Projection::is_cropped_off). A view whose background is not whole stays as it is.
void crop_to_object(View& view);
/// The same where the view is to be thinned(): first pixels and room are multiples of `step`, too.
void crop_to_object_in_steps(View& view, int step);

/// Takes cropped-off pixels in again, as background: `box`, in the pixels of the camera's image as cropped now, and
/// room around it. Camera 0 has the range image, too.
void uncrop(View& view, std::size_t camera, const cv::Rect& box);

/// The same for a range image alone: exactly `all`, in its pixels, which must hold all of it.
void widen(RangeImage& range, const cv::Rect& all);

}  // namespace scanrig
