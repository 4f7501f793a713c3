#include "pipeline/calibration/solve/unknowns.h"

#include <cmath>

namespace scanrig {

PoseBlock to_block(const Transform& transform) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(transform.linear()).normalized();
  const Eigen::Vector3d t = transform.translation();
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

Transform to_transform(const PoseBlock& b) {
  Transform transform = Transform::Identity();
  transform.linear() = Eigen::Quaterniond(b[0], b[1], b[2], b[3]).normalized().toRotationMatrix();
  transform.translation() = Eigen::Vector3d(b[4], b[5], b[6]);
  return transform;
}

Eigen::Vector2d ordered_corner(const Board& board, int id) {
  const int column = id % board.corner_columns(), row = id / board.corner_columns();
  return {(column - 0.5 * (board.corner_columns() - 1)) * board.square_mm,
          (row - 0.5 * (board.corner_rows() - 1)) * board.square_mm};
}

Eigen::Vector2d corner_share(const Board& board, int id) {
  const Eigen::Vector2d place = ordered_corner(board, id);
  return {place.x() / (0.5 * (board.corner_columns() - 1) * board.square_mm),
          place.y() / (0.5 * (board.corner_rows() - 1) * board.square_mm)};
}

LensBlock lens_block(const Camera& camera) {
  const Projection& p = camera.projection;
  const auto& d = camera.distortion;
  return {p.fx, p.fy / p.fx, p.cx, p.cy, d[0], d[1], d[2], d[3], d[4]};
}

Camera make_camera(const CalibrationInput& input, const Unknowns& unknowns, int camera, bool with_field) {
  const CameraUnknowns& from = unknowns.cameras[static_cast<std::size_t>(camera)];
  Camera made;
  made.projection.width = input.width;
  made.projection.height = input.height;
  made.projection.fx = from.lens[0];
  made.projection.fy = from.lens[0] * from.lens[1];
  made.projection.cx = from.lens[2];
  made.projection.cy = from.lens[3];
  for (std::size_t i = 0; i < 5; ++i) made.distortion[i] = from.lens[4 + i];
  made.camera_from_turntable = to_transform(from.camera_from_table);
  made.serial = input.serials[static_cast<std::size_t>(camera)];
  if (with_field) {
    made.lens_field.emplace();
    made.lens_field->width = input.width;
    made.lens_field->height = input.height;
    for (std::size_t i = 0; i < from.field.size(); ++i)
      made.lens_field->shift[i] = {from.field[i][0], from.field[i][1]};
  }
  return made;
}

MeasuredLength first_row_length(const Board& board, double measured_mm, double sigma_mm) {
  const int last = board.corner_columns() - 1;
  return {last * board.square_mm, measured_mm, sigma_mm, std::array<int, 2>{0, last}};
}

ScalePrior scale_prior(const std::optional<MeasuredLength>& length) {
  if (!length) return {};
  return {length->measured_mm / length->nominal_mm - 1.0, length->sigma_mm / length->nominal_mm};
}

}  // namespace scanrig
