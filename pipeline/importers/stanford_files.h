#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "core/result.h"
#include "core/transform.h"

namespace scanrig {

/// One `bmesh` line of a Stanford .conf file, in mm.
struct PlacedScan {
  std::filesystem::path file;
  Transform world_from_scan = Transform::Identity();
};

/// A PLY with a range_grid element (Cyberware scans of the Stanford 3D Scanning Repository).
struct RangeGrid {
  int cols = 0;
  int rows = 0;
  std::vector<Eigen::Vector3d> points;  ///< mm, scan frame
  std::vector<int> cells;               ///< row by row: index of the point, or -1

  [[nodiscard]] int at(int row, int col) const { return cells[static_cast<std::size_t>(row) * cols + col]; }
};

/// The lines "bmesh NAME tx ty tz qx qy qz qw", metres, p' = R(q)^T p + t. NAME is relative to the file's folder. Fails
/// with `not_found`, `io`, `invalid_input` (naming the line; or without any such line).
Result<std::vector<PlacedScan>> read_stanford_conf(const std::filesystem::path& file);

/// Fails with `not_found`, `io`, `invalid_input`, `unsupported` (binary).
Result<RangeGrid> read_range_grid(const std::filesystem::path& file);

}  // namespace scanrig
