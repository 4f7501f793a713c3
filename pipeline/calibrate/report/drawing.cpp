#include "pipeline/calibrate/report/drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/calibrate/report/html.h"

namespace scanrig::report {
namespace {

constexpr double kHeadPx = 4.0;  ///< longest arrow head
constexpr double kMinHeadPx = 0.8;

/// A length on the page without needless digits.
std::string px(double value) {
  std::string text = number(value, 1);
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

std::string pair_of(const Eigen::Vector2d& at) { return px(at.x()) + " " + px(at.y()); }

/// The line and, where it is long enough to be seen, the head.
std::string arrow_path(const Eigen::Vector2d& from, const Eigen::Vector2d& by) {
  std::string path = fmt::format("M{}l{}", pair_of(from), pair_of(by));
  const double head = std::min(kHeadPx, 0.4 * by.norm());
  if (head < kMinHeadPx) return path;
  const Eigen::Vector2d back = -by.normalized() * head, aside(-0.5 * back.y(), 0.5 * back.x());
  return path + "l" + pair_of(back + aside) + "m" + pair_of(-back - aside) + "l" + pair_of(back - aside);
}

using Colour = std::array<double, 3>;

std::string mixed(const Colour& from, const Colour& to, double share) {
  std::array<int, 3> mix{};
  for (std::size_t i = 0; i < 3; ++i) mix[i] = static_cast<int>(std::lround(from[i] + (to[i] - from[i]) * share));
  return fmt::format("#{:02x}{:02x}{:02x}", mix[0], mix[1], mix[2]);
}

}  // namespace

double Window::px_per_unit() const { return width_px / std::abs(right - left); }

Drawing::Drawing(const Window& window)
    : window_(window),
      height_px_(window.height_px > 0.0 ? window.height_px
                                        : window.px_per_unit() * std::abs(window.bottom - window.top)) {}

Eigen::Vector2d Drawing::on_page(const Eigen::Vector2d& at) const {
  return {(at.x() - window_.left) / (window_.right - window_.left) * window_.width_px,
          (at.y() - window_.top) / (window_.bottom - window_.top) * height_px_};
}

void Drawing::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view style) {
  path({from, to}, style);
}

void Drawing::path(const std::vector<Eigen::Vector2d>& points, std::string_view style) {
  if (points.empty()) return;
  std::string d = "M";
  for (std::size_t i = 0; i < points.size(); ++i) d.append(i == 0 ? "" : "L").append(pair_of(on_page(points[i])));
  content_ += fmt::format("<path class=\"line {}\" d=\"{}\"/>\n", style, d);
}

void Drawing::circle(const Eigen::Vector2d& centre, double radius, std::string_view style) {
  const Eigen::Vector2d at = on_page(centre);
  content_ += fmt::format("<circle class=\"line {}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>\n", style, px(at.x()), px(at.y()),
                          px(radius * window_.px_per_unit()));
}

void Drawing::box(const Eigen::Vector2d& corner, const Eigen::Vector2d& opposite, std::string_view style,
                  std::string_view fill) {
  const Eigen::Vector2d a = on_page(corner), b = on_page(opposite);
  const Eigen::Vector2d low = a.cwiseMin(b), size = (a - b).cwiseAbs();
  const std::string filled = fill.empty() ? "" : fmt::format(" style=\"fill:{}\"", fill);
  content_ += fmt::format("<rect class=\"{}\"{} x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\n", style, filled,
                          px(low.x()), px(low.y()), px(size.x()), px(size.y()));
}

void Drawing::disc(const Eigen::Vector2d& centre, double radius_px, std::string_view fill) {
  const Eigen::Vector2d at = on_page(centre);
  content_ += fmt::format("<circle class=\"disc\" style=\"fill:{}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>\n", fill, px(at.x()),
                          px(at.y()), px(radius_px));
}

void Drawing::dots(const std::vector<Eigen::Vector2d>& points, std::string_view style) {
  if (points.empty()) return;
  std::string d;
  for (const Eigen::Vector2d& point : points) d.append("M").append(pair_of(on_page(point))).append("h0");
  content_ += fmt::format("<path class=\"dots {}\" d=\"{}\"/>\n", style, d);
}

void Drawing::arrows(const std::vector<Arrow>& arrows, std::string_view style) {
  if (arrows.empty()) return;
  std::string d;
  for (const Arrow& arrow : arrows)
    d += arrow_path(on_page(arrow.at), on_page(arrow.at + arrow.by) - on_page(arrow.at));
  content_ += fmt::format("<path class=\"arrows {}\" d=\"{}\"/>\n", style, d);
}

void Drawing::text(const Eigen::Vector2d& at, std::string_view words, std::string_view style) {
  const Eigen::Vector2d place = on_page(at);
  content_ += fmt::format("<text class=\"{}\" x=\"{}\" y=\"{}\">{}</text>\n", style, px(place.x()), px(place.y()),
                          escaped(words));
}

std::string Drawing::svg() const {
  return fmt::format("<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">\n{2}</svg>\n", px(window_.width_px),
                     px(height_px_), content_);
}

double round_down(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) return 1.0;
  const double power = std::pow(10.0, std::floor(std::log10(value) + 1e-9));
  for (const double digit : {5.0, 2.0}) {
    if (value >= digit * power * (1.0 - 1e-9)) return digit * power;
  }
  return power;
}

std::string arrow_key(const Window& window, double length, double exaggeration, std::string_view words) {
  const double drawn_px = length * exaggeration * window.px_per_unit();
  Drawing key({.left = 0.0, .right = 400.0, .top = 0.0, .bottom = 20.0, .width_px = 400.0});
  key.arrows({{{2.0, 10.0}, {drawn_px, 0.0}}}, "strong");
  key.text({drawn_px + 10.0, 14.0}, words, "start");
  return key.svg();
}

std::string placement_style(int placement) { return fmt::format("c{}", std::abs(placement) % 8); }

std::string shade(double share) {
  constexpr Colour kLight{255, 255, 229}, kMiddle{65, 160, 190}, kDark{12, 44, 110};
  const double at = std::clamp(std::isfinite(share) ? share : 0.0, 0.0, 1.0);
  return at < 0.5 ? mixed(kLight, kMiddle, 2.0 * at) : mixed(kMiddle, kDark, 2.0 * at - 1.0);
}

std::string signed_shade(double share) {
  constexpr Colour kBlue{33, 102, 172}, kWhite{250, 250, 250}, kRed{178, 24, 43};
  const double at = std::clamp(std::isfinite(share) ? share : 0.0, -1.0, 1.0);
  return at < 0.0 ? mixed(kWhite, kBlue, -at) : mixed(kWhite, kRed, at);
}

}  // namespace scanrig::report
