#include <charconv>
#include <chrono>

#include "config/rig_config.h"
#include "core/catch_exceptions.h"
#include "core/files.h"
#include "core/timestamp.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/acceptance/report/acceptance_report.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;
using acceptance::Acceptance;
using acceptance::AcceptanceReport;
using acceptance::AcceptanceResult;

Result<acceptance::Artefact> artefact_of(const AcceptanceVerb& verb) {
  using acceptance::Kind;
  acceptance::Artefact artefact{.diameter_mm = verb.diameter_mm,
                                .length_mm = verb.length_mm,
                                .heights_mm = verb.heights_mm,
                                .expanded_uncertainty_mm = verb.uncertainty_mm};
  for (const Kind kind : {Kind::sphere, Kind::ball_bar, Kind::plane, Kind::step_gauge}) {
    if (to_string(kind) != verb.what) continue;
    artefact.kind = kind;
    return artefact;
  }
  return fail(ErrorCode::internal, "{}: no such artefact", verb.what);
}

/// Of "NAME=MM".
Result<acceptance::Limits> limits_of(const std::vector<std::string>& words) {
  acceptance::Limits limits;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    double value = 0.0;
    const char* begin = word.data() + std::min(equals, word.size() - 1) + 1;
    const auto read = std::from_chars(begin, word.data() + word.size(), value);
    if (equals == std::string::npos || read.ec != std::errc() || read.ptr != word.data() + word.size()) {
      return fail(ErrorCode::invalid_input, "--limit {}: must be NAME=MM, as form=0.040", word);
    }
    limits[word.substr(0, equals)] = value;
  }
  return limits;
}

/// A mesh, or the model in a model's, scan's or job's folder.
Result<fs::path> model_file(const fs::path& name, const AcceptanceVerb& verb) {
  std::error_code ignored;
  fs::path place = name;
  if (!fs::exists(place, ignored) && !name.has_parent_path()) {
    fs::path jobs = verb.jobs;
    if (jobs.empty()) {
      const auto config = config::read_rig_config(verb.config, {}, config::Cameras::or_simulated);
      if (config) jobs = config->storage.root;
    }
    if (!jobs.empty()) place = jobs / name;
  }
  if (fs::is_regular_file(place, ignored)) return place;
  for (const fs::path& file : {place / "model.ply", place / "model" / "model.ply"}) {
    if (fs::is_regular_file(file, ignored)) return file;
  }
  return fail(ErrorCode::not_found, "{}: no mesh, no folder with a model and no job with one; name a finished scan",
              name.string());
}

Result<Acceptance> measured(const fs::path& file, const acceptance::Artefact& artefact,
                            const acceptance::Limits& limits) {
  const auto mesh = read_mesh(file);
  if (!mesh) return pass_on(mesh);
  auto found = catch_exceptions("the measurement", [&] { return acceptance::measure(*mesh, artefact, limits); });
  if (!found) return pass_on(found, file.string());
  return found;
}

void print_results(const std::vector<AcceptanceResult>& results) {
  fmt::print("  {:<9} {:<12} {:>9} {:>8} {:>8}\n", "result", "of", "error mm", "U (k=2)", "limit");
  for (const AcceptanceResult& result : results) {
    fmt::print("  {:<9} {:<12} {:>9.4f} {:>8.4f} {:>8}  {}\n", result.name, result.feature, result.value_mm,
               result.expanded_uncertainty_mm, result.limit_mm ? fmt::format("{:.4f}", *result.limit_mm) : "-",
               verdict_words(result));
  }
}

void print_report(const AcceptanceReport& report) {
  for (const acceptance::Measurement& one : report.measurements) {
    fmt::print("{}\n", one.model);
    for (const acceptance::Feature& feature : one.found.features) {
      fmt::print("  {}: {} points, {} left out, {:.0f} mm2", feature.name,
                 feature.fit.points.size() + feature.fit.left_out.size(), feature.fit.left_out.size(),
                 feature.area_mm2);
      if (feature.seen_share) fmt::print(" ({:.0f} % of the ball)", 100.0 * *feature.seen_share);
      fmt::print(", rms {:.4f} mm, 95 % within {:.4f} mm\n", feature.fit.errors.rms_mm, feature.fit.range_95_mm());
    }
    print_results(one.found.results);
  }
  if (report.measurements.size() < 2) return;
  fmt::print("largest of {} measurements\n", report.measurements.size());
  print_results(report.worst());
}

}  // namespace

ExitCode measure_artefact(const AcceptanceVerb& verb) {
  const auto artefact = artefact_of(verb);
  if (!artefact) return report_error(artefact.error());
  const auto limits = limits_of(verb.limits);
  if (!limits) return report_error(limits.error());
  if (auto possible = check_artefact(*artefact, *limits); !possible) return report_error(possible.error());
  std::error_code ignored;
  if (!verb.report.empty() && fs::exists(verb.report, ignored)) {
    return report_error({ErrorCode::exists, verb.report.string() + ": already there; name another file with --report"});
  }
  AcceptanceReport report{
      .artefact = *artefact, .date = iso_time(std::chrono::system_clock::now()), .measurements = {}};
  for (const fs::path& name : verb.models) {
    const auto file = model_file(name, verb);
    if (!file) return report_error(file.error());
    auto found = measured(*file, *artefact, *limits);
    if (!found) return report_error(found.error());
    report.measurements.push_back({name.string(), std::move(*found)});
  }
  if (!verb.report.empty()) {
    const auto written = write_file_atomically(verb.report, acceptance_html(report));
    if (!written) return report_error(written.error());
  }
  if (verb.json) {
    fmt::print("{}\n", acceptance_json(report));
  } else {
    print_report(report);
    if (!verb.report.empty()) fmt::print("{}\n", verb.report.string());
  }
  if (report.passes()) return ExitCode::ok;
  return report_error(ExitCode::below_limits, fmt::format("{}: a result is beyond its limit", describe(*artefact)));
}

}  // namespace scanrig::ctl
