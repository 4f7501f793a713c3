#include "pipeline/evaluate/scores.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace scanrig {
namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json to_json(const DistanceFigures& d) {
  return {{"area_mm2", d.area_mm2},
          {"median_mm", number(d.median)},
          {"p95_mm", number(d.p95)},
          {"share_over_0.25_mm", number(d.share_over_025)},
          {"share_over_0.50_mm", number(d.share_over_050)}};
}

json to_json(const Scores::PoseError& error) {
  return {{"deg", error.deg}, {"mm", error.mm}, {"sigmas", number(error.sigmas)}};
}

std::string row(const char* name, const DistanceFigures& d) {
  return fmt::format("{:<34}{:>9.4f} {:>9.4f} {:>9.3f} {:>9.3f}\n", name, d.median, d.p95, 100.0 * d.share_over_025,
                     100.0 * d.share_over_050);
}

std::string row(const char* name, double value, const char* unit) {
  return fmt::format("{:<44}{:>10.4f} {}\n", name, value, unit);
}

}  // namespace

std::vector<Gate> gates(const Scores& s) {
  std::vector<Gate> all = {
      {"A accuracy, median mm", 0.02, s.measured.median},
      {"A accuracy, p95 mm", 0.08, s.measured.p95},
      {"B observable truth covered within 0.1 mm", 0.98, s.covered_010, false},
      {"C false claims (> 0.25 mm)", 0.002, s.measured.share_over_025},
      // The closed share may exceed by what B allows to miss.
      {"E closed share less unobservable share", 0.02, s.closed_share - (1.0 - s.observable_share)},
      {"watertight", 1.0, s.watertight ? 1.0 : 0.0, false},
      {"components", 1.0, static_cast<double>(s.components)},
      {"self-intersecting faces", 0.0, static_cast<double>(s.self_intersections)}};
  if (s.true_genus) all.push_back({"genus off", 0.0, static_cast<double>(std::abs(s.genus - *s.true_genus))});
  if (s.pose2) {
    all.push_back({"pose 2, deg", 0.01, s.pose2->deg});
    all.push_back({"pose 2, mm", 0.01, s.pose2->mm});
  }
  for (const auto& [pose, error] : s.further_poses) {
    all.push_back({fmt::format("pose {}, deg", pose + 1), 0.01, error.deg});
    all.push_back({fmt::format("pose {}, mm", pose + 1), 0.01, error.mm});
  }
  if (s.texture) all.push_back({"texture offset, median px", 0.5, s.texture->median_px});
  return all;
}

json to_json(const Scores& s) {
  json result = {{"measured", to_json(s.measured)},
                 {"observable_share", s.observable_share},
                 {"covered_0.10_mm", number(s.covered_010)},
                 {"covered_0.15_mm", number(s.covered_015)},
                 {"closed_against_ideal_carve", to_json(s.closed)},
                 {"closed_share", s.closed_share},
                 {"unobservable_share", 1.0 - s.observable_share},
                 {"whole", to_json(s.whole)},
                 {"aligned", to_json(s.aligned)},
                 {"frame_height_mm", s.frame_height_mm},
                 {"alignment", {{"deg", s.alignment_deg}, {"mm", s.alignment_mm}}},
                 {"normals",
                  {{"median_deg", number(s.normal_median_deg)},
                   {"p95_deg", number(s.normal_p95_deg)},
                   {"flipped_share", number(s.flipped_share)}}},
                 {"sigma",
                  {{"ratio", number(s.sigma_ratio)},
                   {"share_beyond_2", number(s.beyond_2_sigma)},
                   {"share_beyond_3", number(s.beyond_3_sigma)}}},
                 {"topology",
                  {{"vertices", s.vertices},
                   {"faces", s.faces},
                   {"components", s.components},
                   {"watertight", s.watertight},
                   {"genus", s.genus},
                   {"true_genus", s.true_genus ? json(*s.true_genus) : json()},
                   {"self_intersecting_faces", s.self_intersections}}}};
  for (const SigmaClass& one : s.sigma_classes) {
    result["sigma"]["classes"].push_back({{"name", one.name},
                                          {"count", one.count},
                                          {"ratio", number(one.ratio)},
                                          {"share_within_2", number(one.within_2)},
                                          {"median_mm", number(one.median_mm)}});
  }
  if (s.pose2) result["pose2_error"] = to_json(*s.pose2);
  for (const auto& [pose, error] : s.further_poses) {
    json& row = result["further_pose_errors"].emplace_back(to_json(error));
    row["pose"] = pose;
  }
  if (s.texture) {
    result["texture"] = {{"patches", s.texture->patches},
                         {"median_px", number(s.texture->median_px)},
                         {"p95_px", number(s.texture->p95_px)}};
  }
  for (const Gate& gate : gates(s)) {
    result["gates"].push_back({{"name", gate.name},
                               {"limit", gate.limit},
                               {"measured", number(gate.measured)},
                               {"at_most", gate.at_most},
                               {"ok", gate.ok()}});
  }
  return result;
}

std::string to_table(const Scores& s) {
  std::string text = fmt::format("{:<34}{:>9} {:>9} {:>9} {:>9}\n", "distance to truth, absolute frame", "median mm",
                                 "p95 mm", "% > 0.25", "% > 0.50");
  text += row("measured area", s.measured);
  text += row("measured area, aligned", s.aligned);
  text += row("whole mesh", s.whole);
  text += row("D closed area, to the ideal carve", s.closed);
  text += "\n";
  text += row("observable share of the truth", 100.0 * s.observable_share, "%");
  text += row("observable truth within 0.10 mm", 100.0 * s.covered_010, "%");
  text += row("observable truth within 0.15 mm", 100.0 * s.covered_015, "%");
  text += row("closed share of the model", 100.0 * s.closed_share, "%");
  text += row("unobservable share of the truth", 100.0 * (1.0 - s.observable_share), "%");
  text += row("origin above the truth's, taken out", s.frame_height_mm, "mm");
  text += row("alignment, turn", s.alignment_deg, "deg");
  text += row("alignment, shift", s.alignment_mm, "mm");
  text += row("normals, median", s.normal_median_deg, "deg");
  text += row("normals, p95", s.normal_p95_deg, "deg");
  text += row("error / sigma (1 is honest)", s.sigma_ratio, "");
  text += row("beyond 2 sigma (4.6 is normal)", 100.0 * s.beyond_2_sigma, "%");
  if (!s.sigma_classes.empty()) text += "after alignment: median error, error / sigma, share within 2 sigma\n";
  for (const SigmaClass& one : s.sigma_classes) {
    text += fmt::format("  {:<34}{:>8.4f} mm{:>7.2f}{:>7.1f} %\n", one.name, one.median_mm, one.ratio,
                        100.0 * one.within_2);
  }
  if (s.texture) text += row("texture offset, p95", s.texture->p95_px, "px");
  text += fmt::format("{} vertices, {} faces\n\n", s.vertices, s.faces);
  text += fmt::format("{:<44}{:>10} {:>10}  ok\n", "gate", "limit", "measured");
  for (const Gate& gate : gates(s)) {
    text += fmt::format("{:<44}{} {:>7.3f} {:>10.4f}  {}\n", gate.name, gate.at_most ? "<=" : ">=", gate.limit,
                        gate.measured, gate.ok() ? "yes" : "NO");
  }
  return text;
}

}  // namespace scanrig
