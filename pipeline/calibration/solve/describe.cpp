#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/calibration/solve/sighting_model.h"
#include "pipeline/calibration/solve/solution.h"
#include "pipeline/calibration/solve/volume_error.h"

namespace scanrig {
namespace {

std::vector<int> camera_columns(const Linearised& linear, int cameras) {
  std::vector<int> columns;
  for (std::size_t c = 0; c < static_cast<std::size_t>(cameras); ++c) {
    for (const Columns& group : {linear.lens[c], linear.pose[c], linear.field[c]}) {
      for (int i = 0; i < group.count; ++i) columns.push_back(group.first + i);
    }
  }
  return columns;
}

/// Angle of the table top's normal from the axis: of the dots' plane, or of the flat boards.
std::optional<double> angle_from_square(const Unknowns& u, const BundleSetup& setup) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  if (u.dots.size() >= 3) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& dot : u.dots) {
      const Eigen::Vector3d row(dot[0], dot[2], 1.0);
      sum += row * row.transpose();
      right += row * dot[1];
    }
    const Eigen::Vector3d plane = sum.ldlt().solve(right);
    normal = Eigen::Vector3d(-plane.x(), 1.0, -plane.y());
  }
  for (const KnownHeight& height : setup.heights) {
    const Transform place = to_transform(u.placements[static_cast<std::size_t>(height.placement)]);
    if (place.linear()(1, 2) < -0.9) normal -= place.linear().col(2);
  }
  if (normal.norm() < 0.5) return std::nullopt;
  return to_degrees(std::atan2(std::hypot(normal.x(), normal.z()), normal.y()));
}

void describe_board(const Unknowns& u, const CalibrationSolution& solution, SolvedBoard& board) {
  board.scale = 1.0 + u.shape[0];
  board.aspect = u.shape[1];
  board.shear = u.shape[2];
  board.warp_mm = {u.shape[3], u.shape[4], u.shape[5]};
  board.offsets_mm = u.offsets;
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(solution.linear.columns, 1);
  unit(solution.linear.shape.first, 0) = 1.0;
  board.scale_sigma = solution.normal.half_solve(unit).norm();
}

void describe_table(const CalibrationInput& input, const CalibrationSolution& solution, SolvedTable& table) {
  const Unknowns& u = solution.start.unknowns;
  table.gear = u.gear[0];
  for (std::size_t k = 0; k < input.pairs.size(); ++k) {
    table.angle_error_deg.push_back(to_degrees(u.motions[k][0] - u.gear[0] * input.pairs[k].angle_rad));
  }
  for (const auto& dot : u.dots) table.dots.emplace_back(dot[0], dot[1], dot[2]);
  table.dot_ids = solution.start.dot_ids;
  table.axis_from_square_deg = angle_from_square(u, solution.start.setup);
  table.is_height_known = solution.start.is_height_known;
}

Eigen::Vector2d mean_of(const std::vector<CornerResidual>& residuals) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const CornerResidual& residual : residuals) sum += residual.miss;
  return sum / std::max<double>(1.0, static_cast<double>(residuals.size()));
}

/// The figures of one image.
ImageFit fit_of(const BoardSight& sight, std::vector<CornerResidual> residuals) {
  ImageFit fit;
  fit.corners = static_cast<int>(residuals.size());
  fit.mean_px = mean_of(residuals);
  std::vector<double> sizes, blur;
  for (const CornerResidual& residual : residuals) sizes.push_back(residual.miss.norm());
  for (const CornerObservation& corner : sight.corners) blur.push_back(corner.blur_px);
  if (!sizes.empty()) {
    fit.rms_px = root_mean_square(sizes);
    fit.median_px = quantile(sizes, 0.5);
    fit.blur_px = quantile(blur, 0.5);
  }
  fit.residuals = std::move(residuals);
  return fit;
}

/// Where the board of each pair stood when its images were taken.
std::vector<Transform> turned_boards(const CalibrationInput& input, const StartingPoint& solved) {
  std::vector<Transform> boards;
  for (std::size_t k = 0; k < input.pairs.size(); ++k) {
    const auto& m = solved.unknowns.motions[k];
    const auto placement = static_cast<std::size_t>(solved.setup.placement_of_pair[k]);
    const Transform motion = small_motion({m[1], 0.0, m[2]}, {m[3], m[4], m[5]}) * rot_y(m[0]);
    boards.push_back(motion * to_transform(solved.unknowns.placements[placement]));
  }
  return boards;
}

}  // namespace

double length_on_board(const Board& board, const SolvedBoard& solved, const MeasuredLength& length) {
  if (!length.corners) return length.nominal_mm * solved.scale;
  const std::array<double, 6> shape{solved.scale - 1.0, solved.aspect,     solved.shear,
                                    solved.warp_mm[0],  solved.warp_mm[1], solved.warp_mm[2]};
  const auto end = [&](std::size_t i) {
    const int id = (*length.corners)[i];
    return corner_in_board(shape.data(), solved.offsets_mm[static_cast<std::size_t>(id)].data(),
                           ordered_corner(board, id), corner_share(board, id), nullptr);
  };
  return (end(1) - end(0)).norm();
}

void describe_images(const CalibrationInput& input, const CalibrationSolution& solution,
                     const std::vector<std::array<std::string, 2>>& reasons, SolvedCalibration& out) {
  const auto count = static_cast<std::size_t>(input.cameras);
  // Sightings of images that are left out are described as well.
  UsedImages all(input.pairs.size(), {true, true});
  BundleSetup setup = solution.start.setup;
  setup.sightings = collect_sightings(input, all, {});
  const auto residuals = misses(setup, solution.start.unknowns);
  std::vector<std::vector<CornerResidual>> by_image(input.pairs.size() * count);
  std::map<std::pair<int, int>, std::vector<CornerResidual>> by_placement;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const Sighting& sighting = setup.sightings[i];
    const auto pair = static_cast<std::size_t>(sighting.pair);
    const auto camera = static_cast<std::size_t>(sighting.camera);
    const CornerResidual residual{sighting.point, sighting.pixel, residuals[i]};
    by_image[pair * count + camera].push_back(residual);
    if (!solution.used[pair][camera]) continue;
    by_placement[{input.pairs[pair].placement, sighting.camera}].push_back(residual);
    lengths.push_back(residuals[i].norm());
  }
  out.median_px = quantile(lengths, 0.5);
  out.images.clear();
  for (std::size_t k = 0; k < input.pairs.size(); ++k) {
    for (std::size_t c = 0; c < count; ++c) {
      ImageFit fit = fit_of(c == 0 ? input.pairs[k].left : input.pairs[k].right, std::move(by_image[k * count + c]));
      fit.name = input.pairs[k].name;
      fit.placement = input.pairs[k].placement;
      fit.camera = static_cast<int>(c);
      fit.is_used = solution.used[k][c];
      if (!fit.is_used) fit.left_out_because = reasons[k][c];
      out.images.push_back(std::move(fit));
    }
  }
  out.placements.clear();
  for (const auto& [key, values] : by_placement) out.placements.push_back({key.first, key.second, mean_of(values)});
}

Result<void> describe_solution(const CalibrationInput& input, CalibrationSolution& solution) {
  Unknowns& u = solution.start.unknowns;
  const BundleSetup& setup = solution.start.setup;
  auto linear = linearise(setup, u);
  if (!linear) return pass_on(linear);
  solution.linear = std::move(*linear);
  auto normal = NormalMatrix::factorise(solution.linear);
  if (!normal) return pass_on(normal);
  solution.normal = std::move(*normal);

  SolvedCalibration& out = solution.solved;
  out.cameras = input.cameras;
  out.has_lens_field = setup.with_field;
  out.noise_px = setup.sigma_px;
  out.calibration.left = make_camera(input, u, 0, setup.with_field);
  if (input.cameras == 2) out.calibration.right = make_camera(input, u, 1, setup.with_field);
  out.calibration.table_radius_mm = input.table_radius_mm;
  out.calibration.date = input.date;
  describe_board(u, solution, out.board);
  out.turntable_from_board = turned_boards(input, solution.start);
  const std::vector<int> columns = camera_columns(solution.linear, input.cameras);
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(solution.linear.columns, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) units(columns[i], static_cast<Eigen::Index>(i)) = 1.0;
  const Eigen::MatrixXd half = solution.normal.half_solve(units);
  out.camera_covariance = half.transpose() * half;
  if (input.form != CalibrationInput::Form::table) return {};
  out.table = {};
  describe_table(input, solution, out.table);
  if (input.cameras < 2) return {};
  const std::vector<Eigen::Vector3d> grid = volume_grid(out.calibration);
  const Eigen::MatrixXd response = volume_response(input, u, solution.linear, grid);
  const VolumeParts parts(grid);
  const Eigen::MatrixXd spread = solution.normal.half_solve(response);
  out.sigma = parts.sigma(spread);
  out.sigma_at = parts.sigma_at(spread);
  return {};
}

}  // namespace scanrig
