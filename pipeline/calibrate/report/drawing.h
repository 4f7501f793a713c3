#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace scanrig::report {

/// What a drawing shows, in the units of what is drawn, and its size on the page in CSS pixels.
struct Window {
  double left = 0.0, right = 1.0;
  double top = 0.0, bottom = 1.0;  ///< top > bottom: up is positive
  double width_px = 480.0;
  double height_px = 0.0;  ///< 0: both directions have one scale

  /// One unit on the page, across.
  [[nodiscard]] double px_per_unit() const;
};

/// An arrow from `at`, by `by` as it is drawn: exaggerated by the caller.
struct Arrow {
  Eigen::Vector2d at, by;
};

/// An inline SVG drawing, written to a tenth of a CSS pixel. A style is one or more classes of the page's style sheet.
class Drawing {
 public:
  explicit Drawing(const Window& window);

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view style);
  void path(const std::vector<Eigen::Vector2d>& points, std::string_view style);
  void circle(const Eigen::Vector2d& centre, double radius, std::string_view style);
  void box(const Eigen::Vector2d& corner, const Eigen::Vector2d& opposite, std::string_view style,
           std::string_view fill = "");
  void disc(const Eigen::Vector2d& centre, double radius_px, std::string_view fill);
  void dots(const std::vector<Eigen::Vector2d>& points, std::string_view style);
  void arrows(const std::vector<Arrow>& arrows, std::string_view style);
  void text(const Eigen::Vector2d& at, std::string_view words, std::string_view style = "middle");
  [[nodiscard]] std::string svg() const;

 private:
  [[nodiscard]] Eigen::Vector2d on_page(const Eigen::Vector2d& at) const;

  Window window_;
  double height_px_;
  std::string content_;
};

/// 1, 2 or 5 times a power of ten, at most `value`; 1 for what is not positive.
double round_down(double value);

/// One arrow that stands for `length` (named by `words`) where arrows are `exaggeration` times too long.
std::string arrow_key(const Window& window, double length, double exaggeration, std::string_view words);

/// Style of a placement: one of eight colours.
std::string placement_style(int placement);

/// A colour for 0 (light) to 1 (dark).
std::string shade(double share);
/// A colour for -1 (blue), 0 (white), 1 (red).
std::string signed_shade(double share);

}  // namespace scanrig::report
