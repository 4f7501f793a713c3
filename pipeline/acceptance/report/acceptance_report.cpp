#include "pipeline/acceptance/report/acceptance_report.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace scanrig::acceptance {
namespace {

using nlohmann::ordered_json;

ordered_json to_json(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

ordered_json to_json(const AcceptanceResult& result) {
  ordered_json json{{"name", result.name},
                    {"feature", result.feature},
                    {"value_mm", result.value_mm},
                    {"expanded_uncertainty_mm", result.expanded_uncertainty_mm}};
  if (result.limit_mm) {
    json["limit_mm"] = *result.limit_mm;
    json["verdict"] = result.verdict() == Verdict::pass ? "pass" : "fail";
    json["within_uncertainty"] = result.is_close();
  }
  return json;
}

ordered_json to_json(const std::vector<AcceptanceResult>& results) {
  auto all = ordered_json::array();
  for (const AcceptanceResult& result : results) all.push_back(to_json(result));
  return all;
}

ordered_json to_json(const Feature& feature) {
  const Fit& fit = feature.fit;
  ordered_json json{{"name", feature.name},
                    {"area_mm2", feature.area_mm2},
                    {"points", fit.points.size()},
                    {"left_out", fit.left_out.size()},
                    {"at_rim", feature.at_rim},
                    {"range_mm", fit.range_mm()},
                    {"range_all_mm", fit.range_all_mm()},
                    {"range_95_mm", fit.range_95_mm()},
                    {"rms_mm", fit.errors.rms_mm},
                    {"sigma_mm", to_json(fit.errors.sigma_mm)},
                    {"alike_points", fit.errors.alike},
                    {"alike_mm", fit.errors.alike_mm}};
  if (feature.seen_share) json["seen_share"] = *feature.seen_share;
  if (feature.diameter_mm) json["diameter_mm"] = *feature.diameter_mm;
  return json;
}

ordered_json to_json(const Artefact& artefact) {
  ordered_json json{{"kind", to_string(artefact.kind)}};
  if (artefact.diameter_mm > 0.0) json["diameter_mm"] = artefact.diameter_mm;
  if (artefact.length_mm > 0.0) json["length_mm"] = artefact.length_mm;
  if (!artefact.heights_mm.empty()) json["heights_mm"] = artefact.heights_mm;
  json["expanded_uncertainty_mm"] = artefact.expanded_uncertainty_mm;
  return json;
}

}  // namespace

std::vector<AcceptanceResult> AcceptanceReport::worst() const {
  std::vector<Acceptance> all;
  for (const Measurement& one : measurements) all.push_back(one.found);
  return worst_results(all);
}

bool AcceptanceReport::passes() const {
  return std::ranges::all_of(measurements, [](const Measurement& one) { return one.found.passes(); });
}

std::string describe(const Artefact& artefact) {
  std::string words(to_string(artefact.kind));
  if (artefact.kind == Kind::sphere) words += fmt::format(" of {:.3f} mm", artefact.diameter_mm);
  if (artefact.kind == Kind::ball_bar) {
    words += fmt::format(" of {:.3f} mm, balls of {:.3f} mm", artefact.length_mm, artefact.diameter_mm);
  }
  if (artefact.kind == Kind::step_gauge) words += fmt::format(" of {:.3f} mm", fmt::join(artefact.heights_mm, ", "));
  if (artefact.expanded_uncertainty_mm > 0.0) {
    words += fmt::format(", U = {:.4f} mm", artefact.expanded_uncertainty_mm);
  }
  return words;
}

std::string verdict_words(const AcceptanceResult& result) {
  if (result.verdict() == Verdict::none) return "";
  const std::string verdict = result.verdict() == Verdict::pass ? "pass" : "fail";
  return result.is_close() ? verdict + ", within U of the limit" : verdict;
}

std::string acceptance_json(const AcceptanceReport& report) {
  ordered_json json{{"format", "scanrig-acceptance"},
                    {"version", 1},
                    {"date", report.date},
                    {"artefact", to_json(report.artefact)},
                    {"passes", report.passes()},
                    {"worst", to_json(report.worst())},
                    {"measurements", ordered_json::array()}};
  for (const Measurement& one : report.measurements) {
    auto features = ordered_json::array();
    for (const Feature& feature : one.found.features) features.push_back(to_json(feature));
    json["measurements"].push_back(
        {{"model", one.model}, {"results", to_json(one.found.results)}, {"features", features}});
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace scanrig::acceptance
