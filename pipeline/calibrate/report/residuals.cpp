#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"
#include "pipeline/calibrate/report/sections.h"

namespace scanrig::report {
namespace {

constexpr double kTilePx = 150.0;
constexpr double kTypical = 0.95;       ///< share of the residuals that stay below the arrow's usual length
constexpr double kTypicalShare = 0.07;  ///< that length, of the image's width
constexpr double kKeyShare = 0.25;      ///< length of the arrow that explains the scale, of the image's width
constexpr double kMeanPx = 0.005;       ///< shown in full at least: smaller means look small

std::string remark_of(const FoundBoards& boards, const ImageFit& image) {
  for (const ImageRemark& remark : boards.remarks) {
    if (remark.is_left_out && remark.pair == image.name && static_cast<int>(remark.side) == image.camera) {
      return remark.message;
    }
  }
  return image.left_out_because;
}

Window tile_of(const CalibrationInput& input) {
  return {.left = -0.5, .right = input.width - 0.5, .top = -0.5, .bottom = input.height - 0.5, .width_px = kTilePx};
}

std::string tile(const CalibrationInput& input, std::size_t pair, const ImageFit& image, double exaggeration) {
  const Window window = tile_of(input);
  Drawing drawing(window);
  drawing.box({window.left, window.top}, {window.right, window.bottom}, image.is_used ? "frame" : "frame lost");
  std::vector<Arrow> arrows;
  for (const CornerResidual& r : image.residuals) arrows.push_back({r.pixel, exaggeration * r.miss});
  drawing.arrows(arrows, image.is_used ? "" : "lost");
  std::string words = fmt::format("{} {} deg", side_name(static_cast<std::size_t>(image.camera)),
                                  number(to_degrees(input.pairs[pair].angle_rad), 1));
  if (!image.residuals.empty()) words += fmt::format(", {} px", number(image.rms_px, 3));
  if (!image.is_used) words += ", left out";
  return figure(drawing.svg(), words, "tile");
}

double exaggeration_of(const FolderCalibration& outcome) {
  std::vector<double> lengths;
  for (const ImageFit& image : outcome.judged.solved.images) {
    if (!image.is_used) continue;
    for (const CornerResidual& r : image.residuals) lengths.push_back(r.miss.norm());
  }
  return lengths.empty() ? 1.0 : round_down(kTypicalShare * outcome.input.width / quantile(lengths, kTypical));
}

std::string title_of(const BoardPair& pair) {
  const char* parts = pair.in_a && pair.in_b ? ", in A and B" : pair.in_a ? ", in A" : pair.in_b ? ", in B" : "";
  return fmt::format("Placement {}{}", pair.placement, parts);
}

std::string all_images(const FolderCalibration& outcome) {
  const CalibrationInput& input = outcome.input;
  const SolvedCalibration& solved = outcome.judged.solved;
  const auto cameras = static_cast<std::size_t>(solved.cameras);
  const double exaggeration = exaggeration_of(outcome);
  const double key = round_down(kKeyShare * input.width / exaggeration);
  std::string out = heading("Residuals of each image");
  out += paragraph(fmt::format(
      "Each arrow is measured pixel minus model, drawn {:.6g} times too long. Noise points anywhere; arrows that point "
      "alike in one area are something that the model does not have. Below each image: table angle and rms.",
      exaggeration));
  out += arrow_key(tile_of(input), key, exaggeration, fmt::format("{:.4g} px", key));
  std::map<int, std::vector<std::size_t>> by_placement;
  for (std::size_t k = 0; k < input.pairs.size(); ++k) by_placement[input.pairs[k].placement].push_back(k);
  for (const auto& [placement, pairs] : by_placement) {
    out += heading(title_of(input.pairs[pairs.front()]));
    for (std::size_t c = 0; c < cameras; ++c) {
      std::string tiles;
      for (const std::size_t pair : pairs) tiles += tile(input, pair, solved.images[pair * cameras + c], exaggeration);
      out += row_of(tiles);
    }
  }
  return out;
}

/// Each camera's mean residuals as arrows from one point.
std::string mean_drawings(const SolvedCalibration& solved, double largest) {
  const double reach = std::max(1.3 * largest, kMeanPx);
  std::string figures;
  for (std::size_t c = 0; c < static_cast<std::size_t>(solved.cameras); ++c) {
    Drawing drawing({.left = -reach, .right = reach, .top = -reach, .bottom = reach, .width_px = 260.0});
    drawing.line({-reach, 0.0}, {reach, 0.0}, "faint");
    drawing.line({0.0, -reach}, {0.0, reach}, "faint");
    const double ring = round_down(0.7 * reach);
    drawing.circle({0.0, 0.0}, ring, "faint");
    drawing.text({0.0, -ring * 1.03}, fmt::format("{:.3g} px", ring), "start");
    for (const PlacementFit& fit : solved.placements) {
      if (fit.camera != static_cast<int>(c)) continue;
      drawing.arrows({{Eigen::Vector2d::Zero(), fit.mean_px}}, "strong " + placement_style(fit.placement));
      drawing.text(1.15 * fit.mean_px, fmt::format("{}", fit.placement));
    }
    figures += figure(drawing.svg(), fmt::format("{} camera; numbers are placements", side_name(c)));
  }
  return row_of(figures);
}

std::string means(const SolvedCalibration& solved) {
  double largest = 0.0;
  std::map<int, Row> rows;
  for (const PlacementFit& fit : solved.placements) {
    Row& row = rows.try_emplace(fit.placement, Row{fmt::format("{}", fit.placement), "–", "–"}).first->second;
    row[fit.camera == 0 ? 1 : 2] = fmt::format("{}, {}", number(fit.mean_px.x(), 4), number(fit.mean_px.y(), 4));
    largest = std::max(largest, fit.mean_px.norm());
  }
  std::vector<Row> body;
  for (const auto& [placement, row] : rows) body.push_back(row);
  constexpr std::size_t kMaxDrawn = 20;  // held by hand, every pair is a placement
  std::string out = heading("Mean residual of each placement and camera");
  out += paragraph(
      "A camera that moved between placements, or a board that bent, shows here before it shows in the rms: the noise "
      "of a mean is about 0.002 px.");
  if (body.size() <= kMaxDrawn) out += mean_drawings(solved, largest);
  return out + table({"placement", "left, x and y in px", "right, x and y in px"}, body);
}

}  // namespace

std::string left_out_section(const FolderCalibration& outcome) {
  std::vector<Row> lost, remarked;
  constexpr std::size_t kMaxNamed = 3;
  for (const ImageFit& image : outcome.judged.solved.images) {
    if (image.is_used) continue;
    lost.push_back({image.name, side_name(static_cast<std::size_t>(image.camera)), fmt::format("{}", image.corners),
                    remark_of(outcome.boards, image)});
  }
  for (const auto& [message, remarks] : remarks_on_used_images(outcome.boards)) {
    std::string names;
    for (std::size_t i = 0; i < std::min(kMaxNamed, remarks.size()); ++i) {
      names += fmt::format("{}{}, {}", i == 0 ? "" : "; ", remarks[i].pair, side_name(remarks[i].side));
    }
    if (remarks.size() > kMaxNamed) names += fmt::format("; and {} more", remarks.size() - kMaxNamed);
    remarked.push_back({message, fmt::format("{}", remarks.size()), names});
  }
  std::string out = lost.empty() ? paragraph("Every image is used.")
                                 : table({"image", "camera", "corners", "left out because"}, lost);
  if (!remarked.empty()) {
    out += heading("Remarks on images that are used") + table({"remark", "images", "which"}, remarked);
  }
  return section("What was left out", out);
}

std::string residual_section(const FolderCalibration& outcome) {
  return section("Residuals", means(outcome.judged.solved) + all_images(outcome));
}

}  // namespace scanrig::report
