#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/solve/calibration_input.h"

namespace scanrig {

inline constexpr std::size_t kMinCornersOfBoard = 12;  ///< found in one image, or it does not count

/// A rigid motion as unknowns: quaternion w x y z, then the translation in mm.
using PoseBlock = std::array<double, 7>;

PoseBlock to_block(const Transform& transform);
Transform to_transform(const PoseBlock& block);

/// fx, fy / fx, cx, cy, k1, k2, p1, p2, k3.
using LensBlock = std::array<double, 9>;

struct CameraUnknowns {
  LensBlock lens{};
  PoseBlock camera_from_table{1.0};
  std::array<std::array<double, 2>, LensField::kCount> field{};  ///< as LensField::shift
};

/// All that a calibration solves for. Table frame: as the turntable frame; a board's place is that at table angle 0.
struct Unknowns {
  std::array<CameraUnknowns, 2> cameras;
  std::vector<PoseBlock> placements;           ///< table_from_board
  std::vector<std::array<double, 6>> motions;  ///< per pair: angle (rad), tilt about x and z (rad), shift x y z (mm)
  std::array<double, 1> gear{1.0};             ///< turned angle over reported angle
  std::array<double, 6> shape{};               ///< scale - 1, aspect, shear; warp (mm at the edge) of x^2, x y, y^2
  std::vector<std::array<double, 3>> offsets;  ///< of each corner, board frame, mm
  std::vector<std::array<double, 3>> dots;     ///< rim dots at table angle 0, mm
};

/// The measured place of a corner or a dot in one image.
struct Sighting {
  int pair = 0;
  int camera = 0;
  int point = 0;  ///< corner id, or index into Unknowns::dots
  bool is_dot = false;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Height of a board's middle over the table top, known to `sigma`; mm.
struct KnownHeight {
  int placement = 0;
  double height = 0.0;
  double sigma = 0.02;
};

/// Which sightings the unknowns are adjusted to, and how.
struct BundleSetup {
  const CalibrationInput* input = nullptr;
  std::vector<Sighting> sightings;
  std::vector<int> placement_of_pair;
  std::vector<KnownHeight> heights;  ///< they define y = 0; empty when dots do
  double sigma_px = 0.3;             ///< of a corner, each coordinate
  double dot_sigma_px = 0.05;
  bool with_field = false;
  bool holds_lens_and_board = false;  ///< lenses, fields and print stay as they are
};

/// Nominal place of a corner in the board frame, mm.
Eigen::Vector2d ordered_corner(const Board& board, int id);
/// The same over half of the board's extent: -1..1 in both directions.
Eigen::Vector2d corner_share(const Board& board, int id);

/// The lens of a camera as unknowns.
LensBlock lens_block(const Camera& camera);
/// The camera that the unknowns describe.
Camera make_camera(const CalibrationInput& input, const Unknowns& unknowns, int camera, bool with_field);

/// Standard deviation of the board's scale before the solution, and its mean.
struct ScalePrior {
  double mean = 0.0;
  double sigma = 3e-3;
};
ScalePrior scale_prior(const std::optional<MeasuredLength>& length);

}  // namespace scanrig
