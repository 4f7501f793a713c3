#include "pipeline/calibrate/report/calibration_html.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/version.h"
#include "pipeline/calibrate/report/html.h"
#include "pipeline/calibrate/report/sections.h"

namespace scanrig {
namespace {

using report::escaped;
using report::number;

std::string head_of(const CalibrationJudgement& judgement, const CalibrationOrigin& origin,
                    const FolderCalibration& outcome) {
  const std::string_view grade = to_string(judgement.grade);
  const bool is_refused = judgement.grade == CalibrationGrade::refused;
  std::string out =
      fmt::format("<h1>Calibration <span class=\"grade {0}\">{1}{0}</span></h1>\n", grade, is_refused ? "" : "grade ");
  std::string line = origin.date.empty() ? "" : origin.date + ". ";
  const auto& serials = outcome.input.serials;
  if (!serials[0].empty() || !serials[1].empty()) line += fmt::format("Cameras {} and {}. ", serials[0], serials[1]);
  line += fmt::format("Images of {} x {} pixels. ", outcome.input.width, outcome.input.height);
  if (origin.temperature_c) line += fmt::format("{} degrees Celsius. ", number(*origin.temperature_c, 1));
  out += fmt::format("<p class=\"muted\">{}scanrig {}.</p>\n", escaped(line), escaped(kVersion));
  if (is_refused) out += "<p>It is not written: calibration.json stays as it was.</p>\n";
  if (judgement.sentences.empty()) return out + "<p>Nothing to report: no fault was found.</p>\n";
  out += "<ul>\n";
  for (const std::string& sentence : judgement.sentences) out += fmt::format("<li>{}</li>\n", escaped(sentence));
  return out + "</ul>\n";
}

std::string figures_of(const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  const CalibrationJudgement& judgement = outcome.judged.judgement;
  const auto used = std::ranges::count_if(solved.images, &ImageFit::is_used);
  std::vector<report::Row> rows{
      {"graded by", solved.sigma ? number(judgement.graded_um, 1) + " um" : "no volume to grade",
       "A to 5 um, B to 15, C to 40; above: refused"},
      {"images used", fmt::format("{} of {}", used, solved.images.size()), ""},
      {"noise of a corner", number(solved.noise_px, 4) + " px", "sigma of each coordinate"},
      {"median residual", number(solved.median_px, 4) + " px", "length, over the images used"}};
  if (solved.sigma) {
    rows.push_back({"volume", number(solved.sigma->volume, 2) + " um",
                    "sigma of a point in the working volume: axis, strain and azimuth"});
    rows.push_back({"scale", number(solved.sigma->scale, 2) + " um", "of all lengths alike; from the measured length"});
  }
  if (const auto& ab = judgement.cross_validation) {
    rows.push_back(
        {"A against B", number(ab->ratio(), 2), "difference over what is expected; above 1.5 it lowers the grade"});
  }
  return report::table({"what", "is", "means"}, rows);
}

}  // namespace

std::string calibration_html(const FolderCalibration& outcome, const CalibrationOrigin& origin) {
  std::string content = head_of(outcome.judged.judgement, origin, outcome);
  content += figures_of(outcome);
  for (const auto& section :
       {report::left_out_section, report::residual_section, report::coverage_section, report::sigma_section,
        report::cross_validation_section, report::lens_section, report::board_section, report::turntable_section}) {
    content += section(outcome);
  }
  return report::page("Calibration", content);
}

}  // namespace scanrig
