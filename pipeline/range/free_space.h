#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/rectification.h"

namespace scanrig {

struct FreeSpaceOptions {
  double clearance_mm = 0.5;         ///< what is lower counts as the table
  float coarse_agreement_px = 1.5f;  ///< coarse disparities of both images must agree within this
  int edge_px = 4;            ///< coarse matches this near to others may show something else: half of a block, and two
  double window_share = 0.1;  ///< of the image's width: side of the window that gives the background's light nearby
  int rounds = 4;             ///< of growing: shadows are as wide as several windows
  float same_sigmas = 3.0f;   ///< within this of the background's light a pixel may show it
  float min_noise = 1.0f;     ///< grey levels; least standard deviation of that light
  float max_alike = 0.05f;  ///< of the object's pixels nearby that have the background's light: with more it is no key
};

/// Rectified images of both lights, of one camera. `plain` may be empty.
struct TwoLights {
  cv::Mat1f pattern;
  cv::Mat plain;  ///< BGR, 8 bit, or empty
};

/// Signed distances, px, to where rays are free, positive there: they meet the table's top or what lies behind the
/// working volume.
struct FreeSpace {
  cv::Mat1f left, right;
};

/// Free space without a key. Semi-global matching over all depths finds what the pattern lights of table and room; from
/// there it grows over pixels that the pattern does not tell of, as in the object's shadow, while their plain light is
/// the background's and the object's nearby is not. A pixel that neither light tells of says nothing.
/// `range`: of the left image, with the table. Fails with `internal` (OpenCV).
Result<FreeSpace> free_space(const Rectification& rectification, const RangeImage& range, const TwoLights& left,
                             const TwoLights& right, const FreeSpaceOptions& options);

}  // namespace scanrig
