#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/transform.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/plan.h"

namespace scanrig {

/// The board in one camera's image. Outlines have four corners, pixels; empty: unknown.
struct BoardInImage {
  bool is_seen = false;
  std::string problem{};  ///< what is wrong with the image, for the operator; empty: nothing
  std::vector<Eigen::Vector2d> outline{};
  std::vector<Eigen::Vector2d> expected{};  ///< the outline of the board as planned
};

/// A board on the table, compared with its plan.
struct PlacementView {
  BoardInImage left, right;
  std::optional<double> off_deg{};  ///< between its plane and edges and the planned ones
  std::optional<double> off_mm{};   ///< of its middle

  /// Both cameras see it well, and it is not known to be off by more than is accepted.
  [[nodiscard]] bool is_accepted() const;
};

/// The board's place on the table top, exactly as planned.
Transform planned_table_from_board(const Placement& placement, const Board& board);

/// Compares what a pair of images shows with the plan. `pixel_format` as for find_board(). `calibration` null: unknown,
/// then the board is only found; likewise without `table_deg`, the angle at which the table stands. Threads: any.
PlacementView compare_placement(const cv::Mat& left, const cv::Mat& right, const std::string& pixel_format,
                                const Board& board, const Placement& placement, const Calibration* calibration,
                                std::optional<double> table_deg);

/// One sentence for the operator: "Left: no board. Right: board seen." or "3 deg and 7 mm off the plan: good."
std::string describe(const PlacementView& view);

}  // namespace scanrig
