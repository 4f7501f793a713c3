#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/units.h"
#include "core/version.h"
#include "pipeline/acceptance/report/acceptance_report.h"
#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"

namespace scanrig::acceptance {
namespace {

using report::number;

constexpr int kCells = 48;        // of a map, each way
constexpr double kMapPx = 230.0;  // width of a map
constexpr int kBars = 41;         // of a histogram

std::string mm(double value) { return number(value, 4); }
std::string um(double value_mm) { return number(kMicrometresPerMm * value_mm, 1); }

std::string result_table(const std::vector<AcceptanceResult>& results) {
  std::vector<report::Row> rows;
  for (const AcceptanceResult& result : results) {
    rows.push_back({result.name, result.feature, mm(result.value_mm), mm(result.expanded_uncertainty_mm),
                    result.limit_mm ? mm(*result.limit_mm) : "", verdict_words(result)});
  }
  return report::table({"result", "of", "error, mm", "U (k = 2), mm", "limit, mm", "verdict"}, rows);
}

std::string feature_table(const std::vector<Feature>& features) {
  std::vector<report::Row> rows;
  for (const Feature& feature : features) {
    const Fit& fit = feature.fit;
    rows.push_back(
        {feature.name, fmt::format("{}, {} left out", fit.points.size() + fit.left_out.size(), fit.left_out.size()),
         feature.seen_share ? number(100.0 * *feature.seen_share, 0) + " %" : number(feature.area_mm2, 0) + " mm2",
         feature.diameter_mm ? mm(*feature.diameter_mm) : "", um(fit.errors.rms_mm), um(fit.errors.sigma_mm),
         um(fit.range_95_mm()), um(fit.range_all_mm()), number(fit.errors.alike_mm, 1)});
  }
  return report::table({"feature", "points", "seen", "diameter, mm", "rms, um", "stated sigma, um", "95 % within, um",
                        "all within, um", "alike within, mm"},
                       rows);
}

/// Mean residuals in the cells of a square, -1 to 1 each way.
class Map {
 public:
  void add(const Eigen::Vector2d& at, double residual_mm) {
    const auto cell = [](double x) { return std::clamp(static_cast<int>(0.5 * (x + 1.0) * kCells), 0, kCells - 1); };
    auto& [sum, count] = cells_[place(cell(at.y()), cell(at.x()))];
    sum += residual_mm;
    count += 1.0;
  }
  /// `half`: of the square, across and up, that is drawn.
  [[nodiscard]] std::string svg(double full_mm, const Eigen::Vector2d& half, bool is_round) const {
    const Eigen::Vector2d edge = half.array() + 0.02;
    report::Drawing drawing({.left = -edge.x(),
                             .right = edge.x(),
                             .top = edge.y(),
                             .bottom = -edge.y(),
                             .width_px = kMapPx * edge.x() / edge.maxCoeff()});
    constexpr double kSide = 2.0 / kCells;
    for (int row = 0; row < kCells; ++row) {
      for (int column = 0; column < kCells; ++column) {
        const auto& [sum, count] = cells_[place(row, column)];
        if (count == 0.0) continue;
        const Eigen::Vector2d corner(-1.0 + kSide * column, -1.0 + kSide * row);
        drawing.box(corner, corner + Eigen::Vector2d(kSide, kSide), "",
                    report::signed_shade(std::clamp(sum / count / full_mm, -1.0, 1.0)));
      }
    }
    if (is_round) drawing.circle({0.0, 0.0}, 1.0, "");
    return drawing.svg();
  }

 private:
  static std::size_t place(int row, int column) {
    return static_cast<std::size_t>(row) * kCells + static_cast<std::size_t>(column);
  }

  std::array<std::pair<double, double>, std::size_t{kCells} * kCells> cells_{};
};

/// Both halves of a ball, in an equal-area projection.
std::string ball_maps(const Feature& feature, double full_mm) {
  Map above, below;
  for (std::size_t i = 0; i < feature.points.size(); ++i) {
    const Eigen::Vector3d u = (feature.points[i] - feature.centre).normalized();
    const double r = std::sqrt(1.0 - std::abs(u.y())), across = std::max(std::hypot(u.x(), u.z()), 1e-12);
    (u.y() >= 0.0 ? above : below).add({r * u.x() / across, -r * u.z() / across}, feature.residuals_mm[i]);
  }
  return report::figure(above.svg(full_mm, {1.0, 1.0}, true), feature.name + ", upper half, from above") +
         report::figure(below.svg(full_mm, {1.0, 1.0}, true), feature.name + ", lower half, seen through from above");
}

std::string face_map(const Feature& feature, double full_mm) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY() - feature.normal.y() * feature.normal;
  const Eigen::Vector3d y = up.norm() > 0.1 ? up.normalized() : feature.normal.unitOrthogonal();
  const Eigen::Vector3d x = y.cross(feature.normal);
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const auto& p : feature.points) {
    low = low.cwiseMin(Eigen::Vector2d(p.dot(x), p.dot(y)));
    high = high.cwiseMax(Eigen::Vector2d(p.dot(x), p.dot(y)));
  }
  const double half = 0.5 * (high - low).maxCoeff();
  Map map;
  for (std::size_t i = 0; i < feature.points.size(); ++i) {
    const Eigen::Vector2d at(feature.points[i].dot(x), feature.points[i].dot(y));
    map.add((at - 0.5 * (low + high)) / half, feature.residuals_mm[i]);
  }
  // A cell more, which reaches beyond the outermost points.
  const Eigen::Vector2d drawn = (0.5 * (high - low) / half).array() + 2.0 / kCells;
  return report::figure(map.svg(full_mm, drawn.cwiseMin(1.0), false), feature.name + ", from outside");
}

std::string histogram(const Feature& feature) {
  const auto [low, high] = std::ranges::minmax(feature.residuals_mm);
  const double reach = std::max({std::abs(low), std::abs(high), 1e-9}), bar = 2.0 * reach / kBars;
  std::array<double, kBars> counts{};
  for (const double residual : feature.residuals_mm) {
    const auto at = std::clamp(static_cast<int>((residual + reach) / bar), 0, kBars - 1);
    counts.at(static_cast<std::size_t>(at)) += 1.0;
  }
  const double most = std::ranges::max(counts), left = kMicrometresPerMm * -reach;
  report::Drawing drawing({.left = 1.05 * left,
                           .right = -1.05 * left,
                           .top = 1.05 * most,
                           .bottom = -0.12 * most,
                           .width_px = 300.0,
                           .height_px = 180.0});
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double from = left + kMicrometresPerMm * bar * static_cast<double>(k);
    drawing.box({from, 0.0}, {from + kMicrometresPerMm * bar, counts.at(k)}, "cell", "#0072b2");
  }
  drawing.line({1.05 * left, 0.0}, {-1.05 * left, 0.0}, "");
  const double range[] = {kMicrometresPerMm * std::ranges::min(feature.fit.residuals_mm),
                          kMicrometresPerMm * std::ranges::max(feature.fit.residuals_mm)};
  for (const double end : range) {
    drawing.line({end, 0.0}, {end, most}, "");
    drawing.text({end, -0.1 * most}, number(end, 1));
  }
  return report::figure(drawing.svg(), feature.name + ": residuals, um; between the lines those that count");
}

std::string section_of(const Measurement& one, bool is_only) {
  std::string out = is_only ? std::string() : result_table(one.found.results);
  out += feature_table(one.found.features);
  double full = 1e-6;
  for (const Feature& feature : one.found.features) full = std::max(full, 3.0 * feature.fit.errors.rms_mm);
  for (const Feature& feature : one.found.features) {
    out +=
        report::row_of((feature.diameter_mm ? ball_maps(feature, full) : face_map(feature, full)) + histogram(feature));
  }
  out += report::paragraph(
      fmt::format("Maps: blue inside, red outside the fitted surface, full colour at {} um.", um(full)));
  return report::section(one.model, out);
}

}  // namespace

std::string acceptance_html(const AcceptanceReport& all) {
  const bool has_limits = std::ranges::any_of(all.worst(), [](const auto& r) { return r.limit_mm.has_value(); });
  std::string title = "Acceptance";
  if (has_limits) {
    title += all.passes() ? " <span class=\"grade\">pass</span>" : " <span class=\"grade refused\">fail</span>";
  }
  std::string content = fmt::format("<h1>{}</h1>\n", title);
  content += fmt::format("<p class=\"muted\">{}: {}; {} {}. scanrig {}.</p>\n", report::escaped(all.date),
                         report::escaped(describe(all.artefact)), all.measurements.size(),
                         all.measurements.size() == 1 ? "measurement" : "measurements", report::escaped(kVersion));
  content += result_table(all.worst());
  content += report::paragraph(
      "Results as in VDI/VDE 2634 parts 2 and 3, of measured points alone; least squares, 3 of 1000 points left out. A "
      "verdict is that of the value; U are the points' errors and the artefact's calibration.");
  for (const Measurement& one : all.measurements) content += section_of(one, all.measurements.size() == 1);
  return report::page("Acceptance", content);
}

}  // namespace scanrig::acceptance
