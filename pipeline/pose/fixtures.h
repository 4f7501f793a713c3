#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/pose/estimate_pose.h"

/// Putty, pins or a magnet between table and object: measured with the object in one pose, gone in another.
namespace scanrig {

struct FixtureOptions {
  double cell = 0.01;          ///< width of the cells in which surface is judged, as a share of the object's size
  double reach = 0.003;        ///< share of the object's size: surface nearer to another pose's is not gone there
  double spread = 0.0005;      ///< share of the object's size: error of that pose beside sigma
  int gap_cells = 3;           ///< gone surface across a gap of so many cells is one fixture
  int grown_steps = 2;         ///< of two cells: how far a fixture reaches beyond gone surface where no other pose
                               ///< judges
  double foot = 0.04;          ///< share of the object's size: a fixture begins within this height of the table
  double min_height_mm = 2.0;  ///< lower ones are the table's reflection in the object's foot
  double min_area_mm2 = 10.0;  ///< smaller ones are not named
  AgreementOptions agreement{.witnesses = 2};  ///< of the checks
};

/// What held the object in one pose. In that pose's frame, mm.
struct Fixture {
  double area_mm2 = 0.0;                             ///< of its measured surface
  double height_mm = 0.0;                            ///< of what another pose looked through, above the table
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of that surface
  double cell_mm = 0.0;                              ///< width of a cell
  std::vector<std::uint64_t> cells{};                ///< that its surface takes, and one around; sorted keys
  [[nodiscard]] bool holds(const Eigen::Vector3d& point) const;
};

/// A pose and its place in the model; nothing: it is left out, and neither has a fixture nor shows one.
struct PlacedPose {
  std::span<const View> views;
  std::optional<Transform> model_from_pose;
};

/// The fixture of each pose, nothing where it has none: surface that another pose looked through, connected from the
/// table up, with what is next to it and no other pose judges. What is seen as it is in all poses that look there is
/// object, even if it is putty that was turned over with it. Same bits for any number of threads.
std::vector<std::optional<Fixture>> find_fixtures(std::span<const PlacedPose> poses,
                                                  const FixtureOptions& options = {});

/// Makes the fixture's pixels unmeasured; they do not become background. The matrices are copied before. Returns the
/// points that were measured there, in the pose's frame.
std::vector<Eigen::Vector3f> remove_fixture(const Fixture& fixture, RangeImage& range);

/// How much of the fixtures' surface is still measured.
enum class FixtureSurface : std::uint8_t { whole, remains, gone };

/// For an object on a fixture: contact with the table is no tangent plane, and the verdict forgives the part of the
/// surface that may be the fixture's.
PoseOptions options_for_fixtures(PoseOptions options, FixtureSurface surface);

}  // namespace scanrig
