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

constexpr std::string_view kStyle = R"css(
body{font:15px/1.45 system-ui,sans-serif;color:#1b1f24;background:#fff;max-width:1120px;margin:24px auto;padding:0 20px}
h1{font-size:26px;margin:0 0 4px}
h2{font-size:20px;margin:36px 0 8px;border-bottom:1px solid #ccd1d6;padding-bottom:4px}
h3{font-size:16px;margin:18px 0 4px}
p,li{max-width:820px}
.grade{display:inline-block;padding:2px 14px;border-radius:6px;color:#fff;background:#1a7f37}
.grade.B{background:#3d7a00}.grade.C{background:#9a6700}.grade.refused{background:#b3261e}
.muted{color:#57606a}
table{border-collapse:collapse;margin:8px 0 14px}
th,td{padding:3px 10px;border-bottom:1px solid #e3e6e9;text-align:left;font-variant-numeric:tabular-nums}
th{color:#57606a;font-weight:600}
.row{display:flex;flex-wrap:wrap;gap:14px;align-items:flex-start}
figure{margin:6px 0}
figcaption{font-size:13px;color:#57606a;max-width:520px}
figure.tile{margin:0}
figure.tile figcaption{font-size:11px;line-height:1.25;width:150px}
svg{display:block;font:11px system-ui,sans-serif}
svg .line{fill:none;stroke:#8a939b;stroke-width:1}
svg .faint{stroke:#d5d9dd}
svg .frame{fill:none;stroke:#8a939b}
svg .lost{fill:#fdf0ef;stroke:#b3261e}
svg .cell{stroke:#fff;stroke-width:1}
svg .disc{stroke:#57606a;stroke-width:.5}
svg .dots{fill:none;stroke:#555;stroke-width:2.2;stroke-linecap:round}
svg .arrows{fill:none;stroke:#0b4f9c;stroke-width:1;stroke-linejoin:round}
svg .arrows.lost{fill:none;stroke:#b3261e}
svg .strong{stroke-width:1.6}
svg .big{stroke-width:5}
svg text{fill:#1b1f24}
svg .middle{text-anchor:middle}svg .start{text-anchor:start}svg .end{text-anchor:end}
svg text.light{fill:#fff}
svg .c0{stroke:#555}svg .c1{stroke:#0072b2}svg .c2{stroke:#e69f00}svg .c3{stroke:#009e73}
svg .c4{stroke:#cc79a7}svg .c5{stroke:#56b4e9}svg .c6{stroke:#d55e00}svg .c7{stroke:#8c6d31}
@media print{section{break-inside:auto}figure{break-inside:avoid}}
)css";

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
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width\"/>\n<title>Calibration</title>\n<style>";
  page += kStyle;
  page += "</style>\n</head>\n<body>\n";
  page += head_of(outcome.judged.judgement, origin, outcome);
  page += figures_of(outcome);
  for (const auto& section :
       {report::left_out_section, report::residual_section, report::coverage_section, report::sigma_section,
        report::cross_validation_section, report::lens_section, report::board_section, report::turntable_section}) {
    page += section(outcome);
  }
  return page + "</body>\n</html>\n";
}

}  // namespace scanrig
