#include "pipeline/calibration/corners/rim_dots.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/statistics.h"
#include "pipeline/calibration/corners/disc_fit.h"

namespace scanrig {
namespace {

constexpr double kSurroundingsPx = 5.0;  // around a dot, fitted with it
constexpr double kSurroundingsRadii = 2.5;
constexpr double kMaxReachPx = 200.0;

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

/// Where a dot is expected, and the pixels on and around it.
struct Target {
  DiscShape shape;
  std::vector<FitPixel> pixels;
};

/// Predicts the dots of one image.
class DotPredictor {
 public:
  DotPredictor(const CornerImage& image, const Camera& camera, const RimDots& dots)
      : image_(image), camera_(camera), dots_(dots) {}

  [[nodiscard]] Eigen::Vector2d pixel(double angle_rad) const { return pixel_of(angle_rad, 0.0, {0.0, 0.0}); }
  /// No value: not all of it is in the image.
  [[nodiscard]] std::optional<Target> predict(double angle_rad, double outwards_mm) const;
  /// The likeliest place within `along_mm`.
  [[nodiscard]] std::optional<Target> search(double angle_rad, double along_mm) const;

 private:
  [[nodiscard]] Eigen::Vector2d pixel_of(double angle_rad, double outwards_mm, const Eigen::Vector2d& on_disc) const {
    const double radius_mm = 0.5 * dots_.diameter_mm;
    const Eigen::Vector3d at_front(radius_mm * on_disc.x(), 0.0,
                                   dots_.radius_mm + outwards_mm + radius_mm * on_disc.y());
    return camera_.project(rot_y(angle_rad) * at_front);
  }
  [[nodiscard]] std::vector<FitPixel> pixels_around(const DiscShape& shape, double reach_px) const;

  const CornerImage& image_;
  const Camera& camera_;
  const RimDots& dots_;
};

std::vector<FitPixel> DotPredictor::pixels_around(const DiscShape& shape, double reach_px) const {
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
      if (x < 0 || y < 0 || x >= image_.width() || y >= image_.height()) return {};
      pixels.push_back({from, image_.value(x, y), image_.colour(x, y)});
    }
  }
  return pixels;
}

std::optional<Target> DotPredictor::predict(double angle_rad, double outwards_mm) const {
  const Eigen::Vector3d place = rot_y(angle_rad) * Eigen::Vector3d(0.0, 0.0, dots_.radius_mm + outwards_mm);
  if (!((camera_.camera_from_turntable * place).z() > 1.0)) return std::nullopt;
  const auto shape =
      DiscShape::predict([&](const Eigen::Vector2d& on_disc) { return pixel_of(angle_rad, outwards_mm, on_disc); });
  if (!shape || !camera_.projection.contains(shape->centre())) return std::nullopt;
  const Eigen::Vector2d across =
      pixel_of(angle_rad, outwards_mm, {1.0, 0.0}) - pixel_of(angle_rad, outwards_mm, {-1.0, 0.0});
  const Eigen::Vector2d along =
      pixel_of(angle_rad, outwards_mm, {0.0, 1.0}) - pixel_of(angle_rad, outwards_mm, {0.0, -1.0});
  const double reach = 0.5 * std::hypot(across.norm(), along.norm()) * kSurroundingsRadii;
  if (!(reach < kMaxReachPx)) return std::nullopt;
  Target target{*shape, pixels_around(*shape, reach)};
  if (target.pixels.empty()) return std::nullopt;
  return target;
}

std::optional<Target> DotPredictor::search(double angle_rad, double along_mm) const {
  const double step_mm = 0.35 * dots_.diameter_mm;
  const int steps = static_cast<int>(std::ceil(along_mm / step_mm));
  std::optional<Target> best;
  double most = -1.0;
  for (int i = -steps; i <= steps; ++i) {
    for (const double outwards : {0.0, -step_mm, step_mm}) {
      if (steps == 0 && outwards != 0.0) continue;
      auto target = predict(angle_rad + i * step_mm / dots_.radius_mm, outwards);
      if (!target) continue;
      const double explained = explained_by_disc(target->pixels, image_.colours, target->shape);
      if (explained <= most) continue;
      most = explained;
      best = std::move(target);
    }
  }
  return best;
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
  const DotPredictor predictor(*prepared, camera, dots);
  RimDotFinding found;
  std::vector<MeasuredDot> measured;
  for (int id = 0; id < dots.count; ++id) {
    const double angle = options.angles_rad.empty() ? 2.0 * std::numbers::pi * id / dots.count
                                                    : options.angles_rad[static_cast<std::size_t>(id)];
    const double turned = table_angle_rad + angle;
    const auto is_hidden = [&](const auto& outline) {
      return is_inside(outline, predictor.pixel(turned), kSurroundingsPx);
    };
    if (std::any_of(options.hidden_by.begin(), options.hidden_by.end(), is_hidden)) {
      ++found.hidden;
      continue;
    }
    const auto target = predictor.search(turned, options.search_along_mm);
    if (!target) {
      ++found.outside;
      continue;
    }
    const auto disc = fit_disc(target->pixels, prepared->colours, target->shape, options.search_px);
    if (disc) {
      measured.push_back({{id, target->shape.centre() + disc->shift}, *disc});
    } else {
      ++found.unclear;
    }
  }
  drop_unclear(measured, found, options);
  return found;
}

}  // namespace scanrig
