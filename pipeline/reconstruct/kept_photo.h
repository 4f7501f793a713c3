#pragma once

#include <opencv2/core/mat.hpp>

#include "pipeline/range/rectification.h"
#include "pipeline/silhouette/silhouette.h"

namespace scanrig {

/// A photograph that waits for the texture: of its pixels what can show the object.
struct KeptPhoto {
  cv::Mat3b pixels;      ///< empty: it is read again from the scan's folder
  cv::Point first = {};  ///< of the pixels, on the sensor
  cv::Size sensor = {};  ///< empty: all pixels are kept

  /// The photograph in its own size, black where nothing was kept.
  [[nodiscard]] cv::Mat3b whole() const;
};

/// Keeps what the cropped silhouette shows of the sensor, and a little around it; all of it where the silhouette is not
/// cropped. `map`: from the silhouette's image to the photograph, in the size of the sensor; `step`: of its pixels to
/// one of the silhouette, which may be thinned.
void crop_photo(KeptPhoto& photo, const Silhouette& silhouette, const RectifyingMap& map, int step = 1);

}  // namespace scanrig
