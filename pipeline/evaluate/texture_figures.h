#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/evaluate/scores.h"
#include "pipeline/evaluate/truth_file.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

/// Patches of the texture figures.
struct TextureFigureOptions {
  int patch_px = 32;             ///< side of a patch
  int erosion_px = 6;            ///< of the mask
  int reach_px = 6;              ///< search distance
  double min_gradient = 1.0;     ///< deviation of the gradient over a patch, grey levels per pixel
  double min_correlation = 0.6;  ///< of a clear match
};

/// Draws the textured model into the left camera of every view, from its true position, and searches patches of the
/// drawing in the plain photo. Fails with `degenerate`, `stopped` and as the loading of the photos does.
Result<Scores::TextureFigures> texture_figures(const TexturedMesh& model, const Truth& truth, const ScanFolder& photos,
                                               const TextureFigureOptions& options, const Context& context);

/// Offsets in pixels, one per patch: the place of the patch of `drawn` in `photo`, by normalised correlation
/// of gradient magnitudes (the lights differ), to a fraction of a pixel. Patches stay within `mask` (255) eroded by 6
/// px. Patches without structure, or without a clear match, are left out.
std::vector<double> patch_offsets(const cv::Mat& drawn, const cv::Mat& photo, const cv::Mat1b& mask,
                                  const TextureFigureOptions& options = {});

}  // namespace scanrig
