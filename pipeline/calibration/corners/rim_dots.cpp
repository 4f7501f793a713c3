#include "pipeline/calibration/corners/rim_dots.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/statistics.h"
#include "pipeline/calibration/corners/disc_fit.h"

namespace scanrig {
namespace {

constexpr double kSurroundingsPx = 5.0;    // around a dot, fitted with it
constexpr double kSurroundingsRadii = 2.5;

struct MeasuredDot {
  DotObservation dot;
  Disc disc;
};

bool is_inside(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& pixel, double margin) {
  bool left = true;
  bool right = true;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d side = (outline[(i + 1) % outline.size()] - outline[i]).normalized();
    const Eigen::Vector2d from = pixel - outline[i];
    const double distance = side.x() * from.y() - side.y() * from.x();
    left = left && distance > -margin;
    right = right && distance < margin;
  }
  return !outline.empty() && (left || right);
}

/// Pixels on and around a disc; empty when some are outside the image.
std::vector<FitPixel> pixels_around(const CornerImage& image, const DiscShape& shape, double reach_px) {
  std::vector<FitPixel> pixels;
  const Eigen::Vector2d& centre = shape.centre();
  const auto x0 = static_cast<int>(std::floor(centre.x() - reach_px));
  const auto y0 = static_cast<int>(std::floor(centre.y() - reach_px));
  const auto x1 = static_cast<int>(std::ceil(centre.x() + reach_px));
  const auto y1 = static_cast<int>(std::ceil(centre.y() + reach_px));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Eigen::Vector2d from = Eigen::Vector2d(x, y) - centre;
      const double radii = shape.on_disc(from).norm();
      const double pixels_out = (radii - 1.0) / shape.jacobian(from).norm() * std::numbers::sqrt2;
      if (radii > kSurroundingsRadii || pixels_out > kSurroundingsPx) continue;
      if (x < 0 || y < 0 || x >= image.width() || y >= image.height()) return {};
      pixels.push_back({from, image.value(x, y), image.colour(x, y)});
    }
  }
  return pixels;
}

/// Leaves out dots that look other than the rest.
void drop_unclear(std::vector<MeasuredDot>& measured, RimDotFinding& found, const RimDotOptions& options) {
  std::vector<double> contrasts, residuals;
  for (const MeasuredDot& dot : measured) {
    contrasts.push_back(dot.disc.contrast);
    residuals.push_back(dot.disc.noise);
  }
  if (measured.empty()) return;
  const double contrast = quantile(contrasts, 0.5);
  const double residual = quantile(residuals, 0.5);
  for (const MeasuredDot& dot : measured) {
    const double ratio = dot.disc.contrast / contrast;
    const bool is_clear = ratio > 1.0 / options.max_contrast_ratio && ratio < options.max_contrast_ratio &&
                          std::abs(dot.disc.contrast) > options.min_contrast &&
                          dot.disc.noise < options.max_residual_ratio * residual && dot.disc.size > 0.8 &&
                          dot.disc.size < 1.25 && dot.disc.blur_px > 0.3 && dot.disc.blur_px < 3.0;
    if (is_clear) {
      found.dots.push_back(dot.dot);
    } else {
      ++found.unclear;
    }
  }
}

}  // namespace

Result<RimDotFinding> find_rim_dots(const cv::Mat& image, const std::string& pixel_format, const Camera& camera,
                                    const RimDots& dots, double table_angle_rad, const RimDotOptions& options) {
  if (dots.count < 1 || !(dots.radius_mm > 0.0) || !(dots.diameter_mm > 0.0)) {
    return fail(ErrorCode::invalid_input, "rim dots: none configured; set their number, radius and diameter");
  }
  if (!options.angles_rad.empty() && options.angles_rad.size() != static_cast<std::size_t>(dots.count)) {
    return fail(ErrorCode::invalid_input, "rim dots: {} angles for {} dots; calibrate again", options.angles_rad.size(),
                dots.count);
  }
  const auto prepared = make_corner_image(image, pixel_format);
  if (!prepared) return pass_on(prepared);
  RimDotFinding found;
  std::vector<MeasuredDot> measured;
  for (int id = 0; id < dots.count; ++id) {
    const double angle = options.angles_rad.empty() ? 2.0 * std::numbers::pi * id / dots.count
                                                    : options.angles_rad[static_cast<std::size_t>(id)];
    const Transform turned = rot_y(table_angle_rad + angle);
    const double radius_mm = 0.5 * dots.diameter_mm;
    const auto pixel_of = [&](const Eigen::Vector2d& on_disc) {
      return camera.project(turned * Eigen::Vector3d(radius_mm * on_disc.x(), 0.0, dots.radius_mm + radius_mm * on_disc.y()));
    };
    const auto is_hidden = [&](const auto& outline) { return is_inside(outline, pixel_of({0.0, 0.0}), kSurroundingsPx); };
    if (std::any_of(options.hidden_by.begin(), options.hidden_by.end(), is_hidden)) {
      ++found.hidden;
      continue;
    }
    const bool is_before = (camera.camera_from_turntable * (turned * Eigen::Vector3d(0.0, 0.0, dots.radius_mm))).z() > 1.0;
    const auto shape = is_before ? DiscShape::predict(pixel_of) : std::nullopt;
    const double reach = shape ? 1.5 * (pixel_of({1.0, 0.0}) - pixel_of({-1.0, 0.0})).norm() +
                                     1.5 * (pixel_of({0.0, 1.0}) - pixel_of({0.0, -1.0})).norm() + kSurroundingsPx
                               : 0.0;
    const auto pixels = shape && camera.projection.contains(shape->centre()) && reach < 200.0
                            ? pixels_around(*prepared, *shape, reach)
                            : std::vector<FitPixel>{};
    if (pixels.empty()) {
      ++found.outside;
      continue;
    }
    const auto disc = fit_disc(pixels, prepared->colours, *shape, options.search_px);
    if (disc) {
      measured.push_back({{id, shape->centre() + disc->shift}, *disc});
    } else {
      ++found.unclear;
    }
  }
  drop_unclear(measured, found, options);
  return found;
}

}  // namespace scanrig
