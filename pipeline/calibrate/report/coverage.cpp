#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"
#include "pipeline/calibrate/report/sections.h"
#include "pipeline/calibrate/report/volume_views.h"
#include "pipeline/calibration/judge/sentences.h"

namespace scanrig::report {
namespace {

/// Points by the placement they come from.
using ByPlacement = std::map<int, std::vector<Eigen::Vector2d>>;

std::string image_coverage(const FolderCalibration& outcome, std::size_t camera) {
  const double width = outcome.input.width, height = outcome.input.height;
  const Window window{.left = -0.5, .right = width - 0.5, .top = -0.5, .bottom = height - 0.5, .width_px = 500.0};
  ByPlacement points;
  for (const ImageFit& image : outcome.judged.solved.images) {
    if (!image.is_used || image.camera != static_cast<int>(camera)) continue;
    for (const CornerResidual& r : image.residuals) points[image.placement].push_back(r.pixel);
  }
  Drawing drawing(window);
  drawing.box({window.left, window.top}, {window.right, window.bottom}, "frame");
  for (int i = 1; i < kCoverageColumns; ++i)
    drawing.line({i * width / kCoverageColumns, 0.0}, {i * width / kCoverageColumns, height}, "faint");
  for (int j = 1; j < kCoverageRows; ++j)
    drawing.line({0.0, j * height / kCoverageRows}, {width, j * height / kCoverageRows}, "faint");
  for (const auto& [placement, of_placement] : points) drawing.dots(of_placement, placement_style(placement));
  return figure(drawing.svg(),
                fmt::format("{} camera: {} of {} cells of the image have corners", side_name(camera),
                            covered_cells(outcome.input, outcome.judged.solved, static_cast<int>(camera)),
                            kCoverageColumns * kCoverageRows));
}

/// Corners that both cameras see in the images used, in the turntable frame.
std::map<int, std::vector<Eigen::Vector3d>> corners_in_turntable(const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  std::map<int, std::vector<Eigen::Vector3d>> found;
  for (std::size_t k = 0; k < outcome.input.pairs.size(); ++k) {
    const ImageFit &left = solved.images[2 * k], &right = solved.images[2 * k + 1];
    if (!left.is_used || !right.is_used) continue;
    std::set<int> seen;
    for (const CornerResidual& r : right.residuals) seen.insert(r.id);
    for (const CornerResidual& r : left.residuals) {
      if (!seen.contains(r.id)) continue;
      found[left.placement].push_back(solved.turntable_from_board[k] * outcome.input.board.corner(r.id));
    }
  }
  return found;
}

std::string volume_coverage(const FolderCalibration& outcome) {
  const auto corners = corners_in_turntable(outcome);
  double reach = outcome.input.table_radius_mm, top = CalibrationVolume{}.max_height_mm, low = 0.0;
  std::size_t count = 0;
  for (const auto& [placement, points] : corners) {
    for (const Eigen::Vector3d& p : points) {
      reach = std::max({reach, std::abs(p.x()), std::abs(p.z())});
      top = std::max(top, p.y());
      low = std::min(low, p.y());
    }
    count += points.size();
  }
  const VolumeViews views{.reach_mm = 1.1 * reach, .low_mm = low - 8.0, .top_mm = top + 8.0};
  Drawing above = views.above(outcome.input.table_radius_mm), side = views.side(outcome.input.table_radius_mm);
  for (const auto& [placement, points] : corners) {
    std::vector<Eigen::Vector2d> from_above, from_side;
    for (const Eigen::Vector3d& p : points) {
      from_above.push_back(VolumeViews::in_above(p));
      from_side.push_back(VolumeViews::in_side(p));
    }
    above.dots(from_above, placement_style(placement));
    side.dots(from_side, placement_style(placement));
  }
  std::string out = heading("The volume");
  out += paragraph(fmt::format(
      "{} board corners that both cameras see, in the turntable frame. Dark lines: the volume that is graded. Parts of "
      "it without corners rest on the model alone; low in front and high behind matter most.",
      count));
  return out + row_of(figure(above.svg(), "from above, the cameras below") +
                      figure(side.svg(), "from the side, the cameras to the right"));
}

std::string legend(const FolderCalibration& outcome) {
  std::set<int> placements;
  for (const ImageFit& image : outcome.judged.solved.images) placements.insert(image.placement);
  constexpr std::size_t kMaxNamed = 8;
  if (placements.size() > kMaxNamed) return "";
  Drawing drawing({.left = 0.0, .right = 800.0, .top = 0.0, .bottom = 20.0, .width_px = 800.0});
  double at = 6.0;
  for (const int placement : placements) {
    drawing.dots({{at, 10.0}}, "big " + placement_style(placement));
    drawing.text({at + 8.0, 14.0}, fmt::format("placement {}", placement), "start");
    at += 98.0;
  }
  return drawing.svg();
}

}  // namespace

std::string coverage_section(const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  std::string images;
  for (std::size_t c = 0; c < static_cast<std::size_t>(solved.cameras); ++c) images += image_coverage(outcome, c);
  std::string out = legend(outcome) + heading("The images") + row_of(images);
  if (outcome.input.form == CalibrationInput::Form::table && solved.cameras == 2) out += volume_coverage(outcome);
  return section("Coverage", out);
}

}  // namespace scanrig::report
