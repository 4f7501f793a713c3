#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/statistics.h"
#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"
#include "pipeline/calibrate/report/sections.h"
#include "pipeline/calibrate/report/volume_views.h"

namespace scanrig::report {
namespace {

using Part = double PointSigma::*;

constexpr double kCell = 1.0;        ///< of a map, in its own units
constexpr double kLightText = 0.45;  ///< shades from here on have white figures

/// Rms over the azimuth, by height and radius, micrometres; keys are rounded to a tenth of a millimetre.
struct SigmaMap {
  std::map<long, std::map<long, std::vector<double>>> values;

  SigmaMap(const std::vector<PointSigma>& points, Part part) {
    for (const PointSigma& p : points) {
      const double radius = std::hypot(p.point.x(), p.point.z());
      values[std::lround(10.0 * p.point.y())][std::lround(10.0 * radius)].push_back(p.*part);
    }
  }
  [[nodiscard]] double largest() const {
    double found = 0.0;
    for (const auto& [height, by_radius] : values) {
      for (const auto& [radius, of_ring] : by_radius) found = std::max(found, root_mean_square(of_ring));
    }
    return found;
  }
};

std::string map_of(const SigmaMap& map, double full_scale, std::string_view caption) {
  std::vector<long> radii;
  for (const auto& [height, by_radius] : map.values) {
    for (const auto& [radius, of_ring] : by_radius) radii.push_back(radius);
  }
  std::ranges::sort(radii);
  radii.erase(std::unique(radii.begin(), radii.end()), radii.end());
  const auto rows = static_cast<double>(map.values.size()), columns = static_cast<double>(radii.size());
  Drawing drawing({.left = -1.2,
                   .right = columns,
                   .top = -0.9,
                   .bottom = rows,
                   .width_px = 330.0,
                   .height_px = 26.0 * (rows + 0.9)});
  for (std::size_t i = 0; i < radii.size(); ++i) {
    drawing.text({static_cast<double>(i) + 0.5, -0.25}, fmt::format("r {:.0f}", static_cast<double>(radii[i]) / 10.0));
  }
  double row = 0.0;
  for (auto level = map.values.rbegin(); level != map.values.rend(); ++level, row += kCell) {
    drawing.text({-0.1, row + 0.65}, fmt::format("y {:.0f}", static_cast<double>(level->first) / 10.0), "end");
    for (const auto& [radius, of_ring] : level->second) {
      const auto column = static_cast<double>(std::ranges::lower_bound(radii, radius) - radii.begin());
      const double sigma = root_mean_square(of_ring), share = sigma / full_scale;
      drawing.box({column, row}, {column + kCell, row + kCell}, "cell", shade(share));
      drawing.text({column + 0.5, row + 0.65}, number(sigma, 2), share > kLightText ? "middle light" : "middle");
    }
  }
  return figure(drawing.svg(), caption);
}

/// The volume's sigma around the axis at the lowest, a middle and the highest level.
std::string around(const std::vector<PointSigma>& points) {
  std::map<long, std::vector<PointSigma>> levels;
  double largest = 0.0;
  for (const PointSigma& p : points) {
    levels[std::lround(10.0 * p.point.y())].push_back(p);
    largest = std::max(largest, p.volume);
  }
  const VolumeViews views{.reach_mm = 1.25 * CalibrationVolume{}.radius_mm, .width_px = 330.0};
  std::string figures;
  const std::size_t count = levels.size();
  std::size_t index = 0;
  for (const auto& [level, of_level] : levels) {
    const bool is_shown = index == 0 || index == count / 2 || index + 1 == count;
    ++index;
    if (!is_shown) continue;
    Drawing drawing = views.above(0.0);
    for (const PointSigma& p : of_level) {
      const double share = p.volume / largest;
      drawing.disc(VolumeViews::in_above(p.point), 15.0, shade(share));
      drawing.text(VolumeViews::in_above(p.point) + Eigen::Vector2d(0.0, 1.6), number(p.volume, 1),
                   share > kLightText ? "middle light" : "middle");
    }
    figures += figure(drawing.svg(), fmt::format("volume, um, {:.0f} mm over the table; from above, the cameras below",
                                                 static_cast<double>(level) / 10.0));
  }
  return row_of(figures);
}

}  // namespace

std::string sigma_section(const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  if (!solved.sigma || solved.sigma_at.empty()) {
    return section("Sigma at the object", paragraph("No volume to grade: needs two cameras and the table."));
  }
  const VolumeSigma& s = *solved.sigma;
  std::string out = paragraph(
      "One sigma of a triangulated point, from the covariance of all unknowns, split into what it is due to. It holds "
      "if the model does; A against B is the test of that.");
  out += table({"part", "rms, um", "is"},
               {{"volume", number(s.volume, 2), fmt::format("axis, strain and azimuth; {} at most", number(s.max, 2))},
                {"axis", number(s.axis, 2), "place and direction of the table's axis"},
                {"strain", number(s.strain, 2), "shape, what no motion or scale explains"},
                {"azimuth", number(s.azimuth, 2), "turn about the axis"},
                {"scale", number(s.scale, 2), "all lengths alike; no image shows it, only a measured length"},
                {"base", number(s.base, 2), "height over the table top"}});
  const std::array<std::pair<const char*, Part>, 4> together{{{"volume", &PointSigma::volume},
                                                              {"axis", &PointSigma::axis},
                                                              {"strain", &PointSigma::strain},
                                                              {"azimuth", &PointSigma::azimuth}}};
  const std::array<std::pair<const char*, Part>, 2> apart{{{"scale", &PointSigma::scale}, {"base", &PointSigma::base}}};
  const auto maps = [&](const auto& parts) {
    double full_scale = 1e-9;
    for (const auto& [name, part] : parts) full_scale = std::max(full_scale, SigmaMap(solved.sigma_at, part).largest());
    std::string figures;
    for (const auto& [name, part] : parts) {
      figures += map_of(SigmaMap(solved.sigma_at, part), full_scale, fmt::format("{}, um", name));
    }
    return figures;
  };
  out += heading("By height y and radius r");
  out += paragraph("Heights and radii in mm. The first four maps have one scale of shades, the last two another.");
  out += row_of(maps(together) + maps(apart));
  out += heading("Around the axis") + paragraph("Points that a camera does not see are missing.") +
         around(solved.sigma_at);
  return section("Sigma at the object", out);
}

std::string cross_validation_section(const FolderCalibration& outcome) {
  constexpr std::string_view kTitle = "A against B";
  const auto& ab = outcome.judged.judgement.cross_validation;
  if (!ab) return section(kTitle, paragraph("A and B were not compared: boards are needed for both."));
  std::string out = paragraph(
      "Placements marked A and placements marked B are solved alone. What B makes of the points that A sees, scale and "
      "base taken off. A lens or a board that the model does not fit makes it larger than expected.");
  out += table({"rms, um", "largest, um", "expected rms, um", "ratio"},
               {{number(ab->difference, 2), number(ab->max, 2), number(ab->expected, 2), number(ab->ratio(), 2)}});
  const VolumeViews views{.reach_mm = 1.4 * CalibrationVolume{}.radius_mm};
  constexpr double kLongestMm = 14.0, kKeyMm = 20.0, kUmPerMm = 1e3;
  const double exaggeration = round_down(kLongestMm * kUmPerMm / std::max(ab->max, 1e-6));
  std::vector<Arrow> above, side;
  for (const PointShift& p : ab->shifts) {
    const Eigen::Vector3d shift = p.shift_um * exaggeration / kUmPerMm;
    above.push_back({VolumeViews::in_above(p.point), VolumeViews::in_above(shift)});
    side.push_back({VolumeViews::in_side(p.point), VolumeViews::in_side(shift)});
  }
  Drawing from_above = views.above(0.0), from_side = views.side(0.0);
  from_above.arrows(above, "");
  from_side.arrows(side, "");
  const double key_um = round_down(kKeyMm * kUmPerMm / exaggeration);
  out += paragraph(fmt::format("Arrows are drawn {:.6g} times too long.", exaggeration));
  out += arrow_key(views.window_above(), key_um / kUmPerMm, exaggeration, fmt::format("{:.4g} um", key_um));
  out += row_of(figure(from_above.svg(), "from above, the cameras below") +
                figure(from_side.svg(), "from the side, the cameras to the right"));
  return section(kTitle, out);
}

}  // namespace scanrig::report
