#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"
#include "pipeline/calibrate/report/sections.h"

namespace scanrig::report {
namespace {

constexpr int kAcross = 17, kDown = 13;  ///< arrows of a field
constexpr Eigen::Index kPoseUnknowns = 6, kLensUnknowns = 9;

const Camera& camera_of(const SolvedCalibration& solved, std::size_t camera) {
  return camera == 0 ? solved.calibration.left : solved.calibration.right;
}

/// Column of a camera's first unknown in SolvedCalibration::camera_covariance. Held by hand, the left one has no pose.
Eigen::Index first_unknown(const SolvedCalibration& solved, std::size_t camera) {
  const Eigen::Index field = solved.has_lens_field ? 2 * LensField::kCount : 0;
  return camera == 0 ? 0 : solved.camera_covariance.rows() - (kLensUnknowns + kPoseUnknowns + field);
}

std::string unknowns(const SolvedCalibration& solved) {
  constexpr std::array<const char*, 9> kNames{"fx, px", "fy / fx", "cx, px", "cy, px", "k1", "k2", "p1", "p2", "k3"};
  constexpr std::array<int, 9> kDigits{2, 6, 2, 2, 4, 3, 6, 6, 2};
  std::vector<Row> rows(kNames.size());
  for (std::size_t i = 0; i < kNames.size(); ++i) rows[i].emplace_back(kNames[i]);
  Row head{"unknown"};
  for (std::size_t c = 0; c < static_cast<std::size_t>(solved.cameras); ++c) {
    head.insert(head.end(), {side_name(c), "sigma"});
    const Camera& camera = camera_of(solved, c);
    const Projection& p = camera.projection;
    const auto& d = camera.distortion;
    const std::array<double, 9> values{p.fx, p.fy / p.fx, p.cx, p.cy, d[0], d[1], d[2], d[3], d[4]};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Eigen::Index at = first_unknown(solved, c) + static_cast<Eigen::Index>(i);
      rows[i].push_back(number(values[i], kDigits[i]));
      rows[i].push_back(number(std::sqrt(solved.camera_covariance(at, at)), kDigits[i]));
    }
  }
  return table(head, rows);
}

std::vector<Arrow> field_arrows(const LensField& field) {
  std::vector<Arrow> arrows;
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      const Eigen::Vector2d at((i + 0.5) * field.width / kAcross - 0.5, (j + 0.5) * field.height / kDown - 0.5);
      arrows.push_back({at, field.at(at)});
    }
  }
  return arrows;
}

std::string fields(const SolvedCalibration& solved) {
  std::vector<std::vector<Arrow>> all;
  double largest = 1e-9;
  for (std::size_t c = 0; c < static_cast<std::size_t>(solved.cameras); ++c) {
    all.push_back(field_arrows(*camera_of(solved, c).lens_field));
    for (const Arrow& arrow : all.back()) largest = std::max(largest, arrow.by.norm());
  }
  const double width = camera_of(solved, 0).projection.width, height = camera_of(solved, 0).projection.height;
  const Window window{.left = -0.5, .right = width - 0.5, .top = -0.5, .bottom = height - 0.5, .width_px = 500.0};
  const double exaggeration = round_down(1.6 * width / kAcross / largest);
  const double key = round_down(0.12 * width / exaggeration);
  std::string figures;
  for (std::size_t c = 0; c < all.size(); ++c) {
    double greatest = 0.0;
    for (Arrow& arrow : all[c]) {
      greatest = std::max(greatest, arrow.by.norm());
      arrow.by *= exaggeration;
    }
    Drawing drawing(window);
    drawing.box({window.left, window.top}, {window.right, window.bottom}, "frame");
    drawing.arrows(all[c], "");
    figures += figure(drawing.svg(), fmt::format("{} camera, {} px at most", side_name(c), number(greatest, 3)));
  }
  return paragraph(fmt::format("What the lens does beyond Brown's coefficients, drawn {:.6g} times too long. Where no "
                               "corner was seen it is only smooth.",
                               exaggeration)) +
         arrow_key(window, key, exaggeration, fmt::format("{:.4g} px", key)) + row_of(figures);
}

}  // namespace

std::string lens_section(const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  std::string out = heading("Lens field");
  if (solved.has_lens_field) {
    out += fields(solved);
  } else {
    out += paragraph("Brown's five coefficients suffice: there is no lens field.");
  }
  if (!outcome.input.lens_field) {
    out += paragraph(fmt::format("The field takes {} of chi-square off per coefficient; it is used from 3 on.",
                                 number(solved.field_evidence, 1)));
  }
  out += heading("Cameras") + unknowns(solved);
  return section("Lenses", out);
}

}  // namespace scanrig::report
