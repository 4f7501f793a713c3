#include "pipeline/calibration/corners/image_checks.h"

#include <fmt/format.h>

#include <algorithm>

namespace scanrig {
namespace {

/// Names of the image's edges beyond which the board reaches; empty: none.
std::string edges_crossed(const BoardFinding& finding, cv::Size image) {
  bool left = false;
  bool right = false;
  bool top = false;
  bool bottom = false;
  for (const Eigen::Vector2d& end : finding.outline) {
    left = left || end.x() < 0.0;
    right = right || end.x() > image.width - 1.0;
    top = top || end.y() < 0.0;
    bottom = bottom || end.y() > image.height - 1.0;
  }
  std::string names;
  const auto name = [&](bool is_crossed, const char* edge) {
    if (is_crossed) names += (names.empty() ? "" : " and ") + std::string(edge);
  };
  name(left, "left");
  name(right, "right");
  name(top, "upper");
  name(bottom, "lower");
  return names;
}

}  // namespace

std::vector<ImageCheck> check_board_image(const BoardFinding& finding, const Board& board, cv::Size image,
                                          const ImageLimits& limits) {
  std::vector<ImageCheck> checks;
  if (finding.blur_px > limits.max_blur_px) {
    checks.push_back(
        {ImageProblem::blurred,
         fmt::format("Image blurred ({:.1f} px, at most {:.1f}). Check focus and aperture, and let the table "
                     "settle.",
                     finding.blur_px, limits.max_blur_px),
         fmt::format("blurred, {:.1f} px", finding.blur_px), true});
  }
  if (finding.saturated_share > limits.max_saturated_share) {
    checks.push_back(
        {ImageProblem::glare,
         fmt::format("Glare on {:.0f} % of the board. Shorten the exposure, or turn the board or the lights.",
                     std::max(1.0, 100.0 * finding.saturated_share)),
         fmt::format("glare on {:.0f} % of the board", std::max(1.0, 100.0 * finding.saturated_share)), true});
  }
  const double needed = limits.min_corner_share * board.corner_count();
  const bool are_enough = static_cast<double>(finding.corners.size()) >= needed;
  const std::string edges = edges_crossed(finding, image);
  if (!edges.empty()) {
    checks.push_back(
        {ImageProblem::cut_off,
         fmt::format("Board cut off at the {} edge of the image, {} of {} corners visible{}", edges,
                     finding.corners.size(), board.corner_count(), are_enough ? ": enough." : ". Move it into view."),
         "board partly outside the image, at the " + edges + " edge", false, are_enough});
  }
  if (finding.square_px < limits.min_square_px) {
    checks.push_back(
        {ImageProblem::too_small,
         fmt::format("Board too small or too flat in the image: squares are {:.0f} px, {:.0f} needed. Move or "
                     "tilt it.",
                     finding.square_px, limits.min_square_px),
         fmt::format("board small or flat in the image, squares of {:.0f} px", finding.square_px)});
  }
  if (edges.empty() && !are_enough) {
    checks.push_back({ImageProblem::hidden,
                      fmt::format("Only {} of {} corners visible. Uncover the board, and check its light.",
                                  finding.corners.size(), board.corner_count()),
                      fmt::format("{} of {} corners visible", finding.corners.size(), board.corner_count())});
  }
  return checks;
}

}  // namespace scanrig
