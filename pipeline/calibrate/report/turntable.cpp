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

/// One of the pair's images is used: its table angle is measured.
bool is_used(const SolvedCalibration& solved, std::size_t pair) {
  const auto cameras = static_cast<std::size_t>(solved.cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    if (solved.images[pair * cameras + c].is_used) return true;
  }
  return false;
}

std::string error_curve(const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  std::map<int, std::vector<Eigen::Vector2d>> points;
  double largest = 1e-6, first = 0.0, last = 0.0;
  for (std::size_t k = 0; k < outcome.input.pairs.size(); ++k) {
    if (!is_used(solved, k)) continue;
    const double reported = to_degrees(outcome.input.pairs[k].angle_rad), error = solved.table.angle_error_deg[k];
    points[outcome.input.pairs[k].placement].emplace_back(reported, error);
    largest = std::max(largest, std::abs(error));
    first = std::min(first, reported);
    last = std::max(last, reported);
  }
  const double step = last - first > 720.0 ? 180.0 : 60.0;
  first = step * std::floor(first / step);
  last = step * std::max(std::ceil(last / step), first / step + 1.0);
  const double reach = 1.2 * largest, tick = round_down(largest), margin = 0.12 * (last - first);
  Drawing drawing({.left = first - margin,
                   .right = last + 0.2 * margin,
                   .top = reach,
                   .bottom = -1.25 * reach,
                   .width_px = 720.0,
                   .height_px = 240.0});
  for (double angle = first; angle <= last; angle += step) {
    drawing.line({angle, -reach}, {angle, reach}, "faint");
    drawing.text({angle, -1.2 * reach}, number(angle, 0));
  }
  for (const double at : {-tick, 0.0, tick}) {
    drawing.line({first, at}, {last, at}, at == 0.0 ? "" : "faint");
    drawing.text({first - 0.01 * (last - first), at - 0.04 * reach}, number(at, 4), "end");
  }
  for (const auto& [placement, of_placement] : points) drawing.dots(of_placement, "big " + placement_style(placement));
  return figure(
      drawing.svg(),
      "error of the table angle, degrees, over the reported angle, degrees; turned minus gear times reported; "
      "one colour per placement");
}

/// A rim dot against its place as ordered, the print's start and size fitted.
struct DotError {
  Eigen::Vector2d ordered = Eigen::Vector2d::Zero();  ///< x and z, mm
  Eigen::Vector2d away = Eigen::Vector2d::Zero();     ///< from there to the dot
  double height = 0.0;
};

struct DotErrors {
  std::vector<DotError> dots;
  double radius_mm = 0.0, start_deg = 0.0;
};

DotErrors dot_errors(const CalibrationInput& input, const SolvedTable& table) {
  DotErrors found;
  const double step = 2.0 * M_PI / input.rim_dots.count;
  double s = 0.0, c = 0.0;
  for (std::size_t i = 0; i < table.dots.size(); ++i) {
    const double away = std::atan2(table.dots[i].x(), table.dots[i].z()) - step * table.dot_ids[i];
    s += std::sin(away);
    c += std::cos(away);
    found.radius_mm += std::hypot(table.dots[i].x(), table.dots[i].z()) / static_cast<double>(table.dots.size());
  }
  const double start = std::atan2(s, c);
  found.start_deg = to_degrees(start);
  for (std::size_t i = 0; i < table.dots.size(); ++i) {
    const double at = start + step * table.dot_ids[i];
    DotError dot{found.radius_mm * Eigen::Vector2d(std::sin(at), std::cos(at)), {}, table.dots[i].y()};
    dot.away = Eigen::Vector2d(table.dots[i].x(), table.dots[i].z()) - dot.ordered;
    found.dots.push_back(dot);
  }
  return found;
}

std::string dot_drawing(const DotErrors& errors, double largest) {
  const double reach = 1.15 * errors.radius_mm;
  const Window window{.left = -reach, .right = reach, .top = -reach, .bottom = reach, .width_px = 420.0};
  const double exaggeration = round_down(0.12 * errors.radius_mm / largest);
  Drawing drawing(window);
  drawing.circle({0.0, 0.0}, errors.radius_mm, "faint");
  std::vector<Arrow> arrows;
  std::vector<Eigen::Vector2d> places;
  for (const DotError& dot : errors.dots) {
    arrows.push_back({dot.ordered, exaggeration * dot.away});
    places.push_back(dot.ordered);
  }
  drawing.dots(places, "c0");
  drawing.arrows(arrows, "strong");
  const double key_um = round_down(kMicrometresPerMm * 0.15 * errors.radius_mm / exaggeration);
  return figure(
      drawing.svg() + arrow_key(window, key_um / kMicrometresPerMm, exaggeration, fmt::format("{:.4g} um", key_um)),
      fmt::format("from above, the cameras below: dots against equal steps on a circle, drawn {:.6g} times too long",
                  exaggeration));
}

std::string rim_dots(const FolderCalibration& outcome) {
  const CalibrationInput& input = outcome.input;
  const SolvedTable& solved = outcome.judged.solved.table;
  std::string out = heading("Rim dots");
  if (solved.dots.empty() || input.rim_dots.count <= 0) return out + paragraph("No rim dots were measured.");
  const DotErrors errors = dot_errors(input, solved);
  std::vector<double> away, height;
  double largest = 1e-6;
  for (const DotError& dot : errors.dots) {
    away.push_back(dot.away.norm());
    height.push_back(dot.height);
    largest = std::max(largest, dot.away.norm());
  }
  std::size_t sightings = 0, images = 0;
  for (const BoardPair& pair : input.pairs) {
    for (const BoardSight* sight : {&pair.left, &pair.right}) {
      sightings += sight->dots.size();
      images += sight->dots.empty() ? 0 : 1;
    }
  }
  out += table(
      {"what", "is"},
      {{"dots", fmt::format("{} of {}, measured {} times in {} images", solved.dots.size(), input.rim_dots.count,
                            sightings, images)},
       {"radius", fmt::format("{} mm, {} ordered", number(errors.radius_mm, 4), number(input.rim_dots.radius_mm, 3))},
       {"first dot", fmt::format("{} deg from the front at table angle 0", number(errors.start_deg, 4))},
       {"print",
        fmt::format("{} um rms in the plane, from equal steps", number(kMicrometresPerMm * root_mean_square(away), 1))},
       {"height", fmt::format("{} um rms", number(kMicrometresPerMm * root_mean_square(height), 1))}});
  return out + dot_drawing(errors, largest);
}

}  // namespace

std::string turntable_section(const FolderCalibration& outcome) {
  if (outcome.input.form != CalibrationInput::Form::table) return "";
  const SolvedTable& solved = outcome.judged.solved.table;
  std::vector<double> errors;
  for (std::size_t k = 0; k < solved.angle_error_deg.size(); ++k) {
    if (is_used(outcome.judged.solved, k)) errors.push_back(solved.angle_error_deg[k]);
  }
  std::vector<Row> rows{{"gear", fmt::format("{:.6f} turned over reported angle", solved.gear)},
                        {"angle error", fmt::format("{} deg rms", number(root_mean_square(errors), 5))}};
  if (solved.axis_from_square_deg) {
    rows.push_back(
        {"axis", fmt::format("{} deg from square to the table top", number(*solved.axis_from_square_deg, 4))});
  }
  rows.push_back({"table top", solved.is_height_known ? "seen: y = 0" : "not seen; y = 0 is a board's middle"});
  return section("Turntable", table({"what", "is"}, rows) + error_curve(outcome) + rim_dots(outcome));
}

}  // namespace scanrig::report
