#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sim/scene/board.h"
#include "sim/scene/board_placement.h"
#include "sim/scene/ray_map.h"
#include "sim/scene/room_light.h"
#include "sim/scene/table_top.h"

namespace scanrig::sim {

/// A board on the table, with what holds it, in the plain light of the room. Board and blocks are intersected and
/// filtered in closed form; only the light that they take from each other and from the table is gathered by rays, once
/// for each placement.
/// Threads: render() from any.
class BoardScene {
 public:
  /// `board` must outlive the scene.
  BoardScene(const PrintedBoard& board, PlacedBoard placed, const RimDotErrors& rim_dots);

  /// The light on the sensor of `camera` before the lens's blur, 32-bit float RGB, with the table top at `angle`
  /// (radians); `rays` are the camera's. Samples as render() in renderer.h; edges of the print are averaged in closed
  /// form over each sample. Same arguments, same bits, for any number of threads.
  [[nodiscard]] cv::Mat render(const Eye& camera, const RayMap& rays, double angle, std::uint64_t sampling_seed) const;

 private:
  friend class BoardShot;
  /// A box with the first of its vertices in the light's mesh: four per face, of the board's print a grid.
  struct Box {
    Transform table_from_box;
    Eigen::Vector3d half;
    Eigen::Vector3f albedo;
    int first_vertex;
  };
  void add_print(Object& mesh) const;
  static int add_box(Object& mesh, const Transform& table_from_box, const Eigen::Vector3d& half, bool open_front);

  const PrintedBoard& board_;
  PlacedBoard placed_;
  const RimDotErrors rim_dots_;
  std::vector<Box> boxes_;                            // the board first
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();  // of a sphere around all boxes, in the table's frame
  double radius_ = 0.0;
  std::unique_ptr<RoomLight> light_;
};

}  // namespace scanrig::sim
