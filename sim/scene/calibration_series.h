#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/result.h"
#include "sim/scene/board_renderer.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

/// What goes wrong while a series is taken. 0: it does not. When, where and which way are drawn.
struct SeriesFaults {
  double knock_px = 0.0;  ///< one camera is turned so that its image shifts that much, after placement 2 to 5
  double focus = 0.0;  ///< one camera's focus is changed after placement 2 to 5: share by which its focal length grows
  double blurred = 0.0;     ///< number of images out of focus by 2.5 px
  double slip_mm = 0.0;     ///< the board of one placement slides that far half-way through it
  double cold_px = 0.0;     ///< one camera turns all the time, so that its image shifts that much in the end
  double cut_off_mm = 0.0;  ///< the board of one placement is put that far to the side
};

inline constexpr std::array<NamedValue<SeriesFaults>, 6> kSeriesFaultNames = {{
    {"knock", &SeriesFaults::knock_px},
    {"focus", &SeriesFaults::focus},
    {"blurred", &SeriesFaults::blurred},
    {"slip", &SeriesFaults::slip_mm},
    {"cold", &SeriesFaults::cold_px},
    {"cut-off", &SeriesFaults::cut_off_mm},
}};

struct SeriesOptions {
  std::optional<RigVariation> rig = std::nullopt;  ///< nothing: the default rig
  std::uint64_t seed = 1;                          ///< the print, how the board is put down, faults, noise
  double image_scale = 1.0;
  bool noise = true;
  BoardLayout board{};
  PrintErrors print{};
  bool exact_placements = false;  ///< the operator errs in nothing
  std::vector<int> placements{};  ///< numbers of the plan to take; empty: all
  int angles = 7;                 ///< per placement, one more of the flat one
  int hand_held = 0;              ///< that many pairs of a board held by hand instead of the plan
  SeriesFaults faults{};
  ChosenProfile profile{};  ///< as declared: profile 1; of another the effects on optics, sensors, mechanics and drift
};

/// One pair of images to take, and the truth of it.
struct SeriesPair {
  std::string name;   ///< of the files
  int placement = 0;  ///< number in the plan; hand-held: counts the pairs from 1
  int image = 1;      ///< from 1, within the placement
  bool in_a = true;
  bool in_b = true;
  double reported_deg = 0.0;                           ///< by the table
  double true_deg = 0.0;                               ///< about the axis; 0 for a hand-held board
  Transform table_from_board = Transform::Identity();  ///< in the frame that turns about the axis
  RigGeometry rig;                                     ///< cameras at the time
  double left_blur_px = 0.0, right_blur_px = 0.0;      ///< sigma beside the lens's own
};

/// A calibration series: the plan of placements and angles of one board before one rig.
/// Threads: one at a time.
class CalibrationSeries {
 public:
  /// Fails with `out_of_range` (image scale outside its limits, a board that cannot be made or is larger than the
  /// table, no such placement, angles outside 1 to 99, hand-held pairs below 0 or above 999).
  static Result<std::unique_ptr<CalibrationSeries>> create(const SeriesOptions& options);

  [[nodiscard]] const SeriesOptions& options() const { return options_; }
  [[nodiscard]] const DrawnRig& rig() const { return rig_; }
  [[nodiscard]] const PrintedBoard& board() const { return board_; }
  [[nodiscard]] const std::vector<SeriesPair>& pairs() const { return pairs_; }
  /// Turntable frame of the pair from the frame of the table's angle: runout and wobble.
  [[nodiscard]] Transform table_motion(const SeriesPair& pair) const;
  /// Pixel of corner `id` in an image of the pair, by the truth.
  [[nodiscard]] Eigen::Vector2d corner_pixel(const SeriesPair& pair, bool left, int id) const;

  /// Renders pair `index`, 8 bit BayerRG8. Same options, same bits, for any number of threads and any order.
  StereoImages shoot(std::size_t index);

 private:
  explicit CalibrationSeries(const SeriesOptions& options);
  void plan_placements();
  void plan_hand_held();
  void add_faults();
  void change_cameras();
  void move_boards();

  SeriesOptions options_;
  DrawnRig rig_;
  std::array<CameraModel, 2> cameras_;
  PrintedBoard board_;
  std::vector<SeriesPair> pairs_;
  std::vector<PlacedBoard> placed_;  // by pair
  std::unique_ptr<BoardScene> scene_;
  std::size_t scene_of_ = 0;  // the pair that it was made for
  // Rays by camera; a changed focus makes them anew.
  struct Rays {
    double fx;
    RayMap map;
  };
  std::array<std::unique_ptr<Rays>, 2> rays_;
};

}  // namespace scanrig::sim
