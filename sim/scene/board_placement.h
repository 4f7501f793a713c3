#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/transform.h"
#include "sim/scene/board.h"

namespace scanrig::sim {

/// A matte grey block with its faces along its own axes.
struct Block {
  Transform table_from_block = Transform::Identity();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< mm
  float albedo = 0.3F;
};

/// How a placement is ordered, design of the calibration's plan.
struct PlannedPlacement {
  int number = 1;  ///< from 1
  bool in_a = true;
  bool in_b = false;
  bool portrait = false;
  double tilt_deg = 60.0;  ///< of the print, from flat
  double front_mm = 0.0;   ///< of the board's middle before the axis, towards the cameras
  bool on_block = false;   ///< a block of 40 mm under its lower edge
  double mark_deg = 0.0;   ///< table angle, from the reported zero, at which it is put down before the operator
};

/// The seven placements.
const std::vector<PlannedPlacement>& calibration_plan();

/// Table angles, as the operator is shown them, at which a placement is taken: `count` over +-56 degrees around where
/// it faces the cameras; of the flat one eight over the turn when `count` is 7, else count + 1. Within +-180 degrees.
std::vector<double> planned_angles(const PlannedPlacement& placement, int count);

/// A board where it is put down, and what holds it.
struct PlacedBoard {
  Transform table_from_board;  ///< on the table top
  std::vector<Block> blocks;
};

/// The board put down as planned by an operator who errs by up to 10 degrees in tilt and azimuth and 15 mm, or exactly.
/// `facing_rad`: azimuth on the table that faces the cameras at the mark.
PlacedBoard put_down(const PlannedPlacement& placement, const BoardLayout& board, double facing_rad, bool exactly,
                     std::uint64_t seed);

/// The board and what holds it, pressed into the table top.
PlacedBoard sunk(PlacedBoard placed, double mm);

/// The board held in mid-air before the cameras, differently for every `number`.
PlacedBoard held_by_hand(std::uint64_t seed, int number);

}  // namespace scanrig::sim
