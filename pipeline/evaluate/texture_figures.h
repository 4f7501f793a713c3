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

/// Draws the textured model into the left camera of every view, from where it truly stood, and looks for patches of the
/// drawing in the plain photo. Fails with `degenerate`, `stopped` and as the loading of the photos does.
Result<Scores::TextureFigures> texture_figures(const TexturedMesh& model, const Truth& truth, const ScanFolder& photos,
                                               const Context& context);

/// Offsets in pixels, a 32 x 32 patch each: where the patch of `drawn` is found in `photo`, by normalised correlation
/// of gradient magnitudes (the lights differ), to a fraction of a pixel. Patches reach no further than `mask` (255)
/// does when eroded by 6 px; those without structure, or found nowhere clearly, are left out.
std::vector<double> patch_offsets(const cv::Mat& drawn, const cv::Mat& photo, const cv::Mat1b& mask);

}  // namespace scanrig
