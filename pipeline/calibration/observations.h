#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace scanrig {

/// One corner of the board in one image.
struct CornerObservation {
  int id = 0;             ///< as in Board::corner()
  Eigen::Vector2d pixel;  ///< distorted; pixel centres at integer coordinates
  double blur_px = 0.0;   ///< sigma of the fitted edges
};

/// One printed dot of the table's rim in one image.
struct DotObservation {
  int id = 0;             ///< counter-clockwise seen from above, from the first dot; see RimDots
  Eigen::Vector2d pixel;  ///< of the dot's centre, the ellipse's eccentricity taken off
};

/// What one camera shows of one table angle.
struct BoardSight {
  std::vector<CornerObservation> corners;  ///< ascending id; empty: no board found
  std::vector<DotObservation> dots;
};

/// One stereo pair of a board that stands on the table.
struct BoardPair {
  std::string name;        ///< for reports: "placement 4 image 3", or a file's
  int placement = 0;       ///< pairs of one placement share the board's place on the table
  bool in_a = true;        ///< takes part in calibration A, of A against B
  bool in_b = true;        ///< likewise B
  double angle_rad = 0.0;  ///< of the table as reported, counter-clockwise seen from above
  BoardSight left;
  BoardSight right;
};

/// The dots printed on the table's rim, as ordered: equal steps on one circle, y = 0.
struct RimDots {
  int count = 0;  ///< 0: none
  double radius_mm = 0.0;
  double diameter_mm = 0.0;
};

}  // namespace scanrig
