#include "pipeline/calibration/solve/bundle.h"

#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "core/units.h"
#include "pipeline/calibration/solve/bundle_costs.h"
#include "pipeline/calibration/solve/sighting_model.h"

namespace scanrig {
namespace {

constexpr double kLossSigmas = 3.0;
constexpr double kGaugeMm = 1e-3;    ///< of what the frame is defined by
constexpr double kModeMm = 1e-4;     ///< of what corner offsets may have in common
constexpr double kDotPlaceMm = 1.0;  ///< of a dot's place on the rim around its start

ceres::Problem::Options problem_options() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

/// The problem over the unknowns, which must outlive it.
class Bundle {
 public:
  Bundle(const BundleSetup& setup, Unknowns& unknowns)
      : setup_(setup), input_(*setup.input), u_(unknowns), manifold_(pose_manifold()), problem_(problem_options()) {
    has_table_ = input_.form == CalibrationInput::Form::table;
    for (const Sighting& sighting : setup.sightings) add(sighting);
    add_camera_priors();
    add_board_priors();
    if (has_table_) {
      add_table();
    } else {
      for (auto& motion : u_.motions) {
        if (problem_.HasParameterBlock(motion.data())) problem_.SetParameterBlockConstant(motion.data());
      }
      problem_.SetParameterBlockConstant(u_.cameras[0].camera_from_table.data());
    }
    if (setup.holds_lens_and_board) hold_lens_and_board();
  }

  ceres::Problem& problem() { return problem_; }
  [[nodiscard]] const std::vector<ceres::ResidualBlockId>& rows() const { return rows_; }

 private:
  void add(ceres::CostFunction* cost, ceres::LossFunction* loss, const std::vector<double*>& blocks) {
    rows_.push_back(problem_.AddResidualBlock(cost, loss, blocks));
  }

  void add(const Sighting& s) {
    CameraUnknowns& camera = u_.cameras[static_cast<std::size_t>(s.camera)];
    const LensFieldSupport support = LensField::support(s.pixel, input_.width, input_.height);
    const LensFieldSupport* field = setup_.with_field ? &support : nullptr;
    std::vector<double*> blocks{camera.lens.data(), camera.camera_from_table.data(),
                                u_.motions[static_cast<std::size_t>(s.pair)].data()};
    const auto point = static_cast<std::size_t>(s.point);
    ceres::CostFunction* cost = nullptr;
    if (s.is_dot) {
      blocks.push_back(u_.dots[point].data());
      cost = dot_cost(s.pixel, field, setup_.dot_sigma_px);
    } else {
      const int placement = setup_.placement_of_pair[static_cast<std::size_t>(s.pair)];
      double* pose = u_.placements[static_cast<std::size_t>(placement)].data();
      blocks.insert(blocks.end(), {pose, u_.shape.data(), u_.offsets[point].data()});
      cost = corner_cost(s.pixel, ordered_corner(input_.board, s.point), corner_share(input_.board, s.point), field,
                         setup_.sigma_px);
      problem_.AddParameterBlock(pose, 7, manifold_.get());
    }
    for (int k = 0; field && k < 16; ++k) {
      blocks.push_back(camera.field[support.coefficient(k % 4, k / 4)].data());
    }
    problem_.AddParameterBlock(camera.camera_from_table.data(), 7, manifold_.get());
    add(cost, &loss_, blocks);
  }

  void hold_lens_and_board() {
    const auto hold = [this](auto& block) {
      if (problem_.HasParameterBlock(block.data())) problem_.SetParameterBlockConstant(block.data());
    };
    for (CameraUnknowns& camera : u_.cameras) {
      hold(camera.lens);
      for (auto& shift : camera.field) hold(shift);
    }
    hold(u_.shape);
    for (auto& corner : u_.offsets) hold(corner);
  }

  void add_camera_priors() {
    const CalibrationPriors& p = input_.priors;
    for (int c = 0; c < input_.cameras; ++c) {
      CameraUnknowns& camera = u_.cameras[static_cast<std::size_t>(c)];
      std::vector<double> mean{input_.nominal_focal_px, 1.0, 0.5 * (input_.width - 1), 0.5 * (input_.height - 1)};
      std::vector<double> sigma{input_.nominal_focal_px * p.focal_share, p.focal_ratio, p.principal_px, p.principal_px};
      mean.resize(9, 0.0);
      sigma.insert(sigma.end(), p.distortion.begin(), p.distortion.end());
      add(prior_cost(mean, sigma), nullptr, {camera.lens.data()});
      if (!setup_.with_field) continue;
      for (auto& shift : camera.field) {
        add(prior_cost({0.0, 0.0}, {p.lens_field_px, p.lens_field_px}), nullptr, {shift.data()});
      }
    }
  }

  void add_board_priors() {
    const bool paper = input_.board_kind == BoardKind::paper;
    const bool joins_corners = input_.length && input_.length->corners;
    const ScalePrior scale = scale_prior(joins_corners ? std::nullopt : input_.length);
    const double skew = paper ? 1e-3 : 1e-4;
    add(prior_cost({scale.mean, 0, 0, 0, 0, 0}, {scale.sigma, skew, skew, 0.1, 0.1, 0.1}), nullptr, {u_.shape.data()});
    const std::vector<double> offset =
        paper ? std::vector<double>{0.05, 0.05, 0.1} : std::vector<double>{0.01, 0.01, 0.03};
    std::vector<double*> all;
    for (auto& corner : u_.offsets) {
      add(prior_cost({0, 0, 0}, offset), nullptr, {corner.data()});
      all.push_back(corner.data());
    }
    add(offset_modes_cost(input_.board, kModeMm), nullptr, all);
    if (!joins_corners) return;
    const auto [from, to] = *input_.length->corners;
    add(length_cost(input_.board, *input_.length), nullptr,
        {u_.shape.data(), u_.offsets[static_cast<std::size_t>(from)].data(),
         u_.offsets[static_cast<std::size_t>(to)].data()});
  }

  void add_table() {
    const CalibrationPriors& p = input_.priors;
    for (std::size_t k = 0; k < u_.motions.size(); ++k) {
      if (!problem_.HasParameterBlock(u_.motions[k].data())) continue;
      add(motion_cost(input_.pairs[k].angle_rad, to_radians(p.angle_deg), to_radians(p.table_tilt_deg),
                      p.table_shift_mm),
          nullptr, {u_.motions[k].data(), u_.gear.data()});
    }
    add(prior_cost({u_.gear[0] < 0.0 ? -1.0 : 1.0}, {p.gear_share}), nullptr, {u_.gear.data()});
    std::vector<double*> poses;
    for (int c = 0; c < input_.cameras; ++c) {
      poses.push_back(u_.cameras[static_cast<std::size_t>(c)].camera_from_table.data());
    }
    add(azimuth_cost(input_.cameras, kGaugeMm), nullptr, poses);
    for (const KnownHeight& h : setup_.heights) {
      add(height_cost(h.height, h.sigma), nullptr, {u_.placements[static_cast<std::size_t>(h.placement)].data()});
    }
    for (auto& dot : u_.dots) {
      add(prior_cost({dot[0], 0.0, dot[2]}, {kDotPlaceMm, p.dot_height_mm, kDotPlaceMm}), nullptr, {dot.data()});
    }
  }

  const BundleSetup& setup_;
  const CalibrationInput& input_;
  Unknowns& u_;
  bool has_table_ = true;
  ceres::CauchyLoss loss_{kLossSigmas};
  std::unique_ptr<ceres::Manifold> manifold_;
  ceres::Problem problem_;
  std::vector<ceres::ResidualBlockId> rows_;
};

class StopCheck final : public ceres::IterationCallback {
 public:
  explicit StopCheck(const Context& context) : context_(context) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*summary*/) override {
    return context_.stopped() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const Context& context_;
};

/// The blocks of the problem in the order of Linearised's columns; those of `groups` are counted.
class ColumnOrder {
 public:
  explicit ColumnOrder(ceres::Problem& problem) : problem_(problem) {}
  Columns take(const std::vector<double*>& group) {
    Columns columns{next_, 0};
    for (double* block : group) {
      if (!problem_.HasParameterBlock(block) || problem_.IsParameterBlockConstant(block)) continue;
      blocks_.push_back(block);
      columns.count += problem_.ParameterBlockTangentSize(block);
    }
    next_ += columns.count;
    return columns;
  }
  [[nodiscard]] const std::vector<double*>& blocks() const { return blocks_; }
  [[nodiscard]] int count() const { return next_; }

 private:
  ceres::Problem& problem_;
  std::vector<double*> blocks_;
  int next_ = 0;
};

template <class Blocks>
std::vector<double*> all_of(Blocks& blocks) {
  std::vector<double*> found;
  for (auto& block : blocks) found.push_back(block.data());
  return found;
}

void order_columns(ColumnOrder& order, Unknowns& u, Linearised& out) {
  for (std::size_t c = 0; c < 2; ++c) {
    out.lens[c] = order.take({u.cameras[c].lens.data()});
    out.pose[c] = order.take({u.cameras[c].camera_from_table.data()});
    out.field[c] = order.take(all_of(u.cameras[c].field));
  }
  for (auto& placement : u.placements) out.placements.push_back(order.take({placement.data()}));
  order.take(all_of(u.motions));
  order.take({u.gear.data()});
  out.shape = order.take({u.shape.data()});
  order.take(all_of(u.offsets));
  order.take(all_of(u.dots));
  out.columns = order.count();
}

}  // namespace

Result<int> adjust(const BundleSetup& setup, Unknowns& unknowns, double tolerance, const Context& context) {
  Bundle bundle(setup, unknowns);
  StopCheck stop(context);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = 100;
  options.function_tolerance = tolerance;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &bundle.problem(), &summary);
  if (context.stopped()) return fail(ErrorCode::stopped, "calibration: stopped");
  if (summary.termination_type != ceres::CONVERGENCE) {
    return fail(ErrorCode::degenerate, "calibration: no solution found ({} steps); check board layout and corners",
                summary.num_successful_steps + summary.num_unsuccessful_steps);
  }
  return summary.num_successful_steps + summary.num_unsuccessful_steps;
}

Result<Linearised> linearise(const BundleSetup& setup, Unknowns& unknowns) {
  Bundle bundle(setup, unknowns);
  Linearised out;
  ColumnOrder order(bundle.problem());
  order_columns(order, unknowns, out);
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = order.blocks();
  options.residual_blocks = bundle.rows();
  options.apply_loss_function = true;
  options.num_threads = 1;
  double cost = 0.0;
  ceres::CRSMatrix jacobian;
  if (!bundle.problem().Evaluate(options, &cost, &out.residual, nullptr, &jacobian)) {
    return fail(ErrorCode::degenerate, "calibration: the solution has no derivatives");
  }
  out.row_start = std::move(jacobian.rows);
  out.column = std::move(jacobian.cols);
  out.value = std::move(jacobian.values);
  return out;
}

double robust_chi2(const BundleSetup& setup, Unknowns& unknowns) {
  Bundle bundle(setup, unknowns);
  ceres::Problem::EvaluateOptions options;
  options.num_threads = 1;
  double cost = 0.0;
  bundle.problem().Evaluate(options, &cost, nullptr, nullptr, nullptr);
  return 2.0 * cost;
}

std::vector<Eigen::Vector2d> misses(const BundleSetup& setup, const Unknowns& u) {
  const CalibrationInput& input = *setup.input;
  std::vector<Eigen::Vector2d> found;
  found.reserve(setup.sightings.size());
  for (const Sighting& s : setup.sightings) {
    const CameraUnknowns& camera = u.cameras[static_cast<std::size_t>(s.camera)];
    const double* motion = u.motions[static_cast<std::size_t>(s.pair)].data();
    const auto point = static_cast<std::size_t>(s.point);
    Eigen::Vector2d model;
    if (s.is_dot) {
      model = table_pixel(camera.lens.data(), camera.camera_from_table.data(), motion,
                          Eigen::Vector3d(u.dots[point][0], u.dots[point][1], u.dots[point][2]), nullptr, nullptr);
    } else {
      const auto placement = static_cast<std::size_t>(setup.placement_of_pair[static_cast<std::size_t>(s.pair)]);
      model = corner_pixel(camera.lens.data(), camera.camera_from_table.data(), motion, u.placements[placement].data(),
                           u.shape.data(), u.offsets[point].data(), ordered_corner(input.board, s.point),
                           corner_share(input.board, s.point), nullptr);
    }
    if (setup.with_field) {
      const LensFieldSupport f = LensField::support(s.pixel, input.width, input.height);
      for (int k = 0; k < 16; ++k) {
        const auto& c = camera.field[f.coefficient(k % 4, k / 4)];
        model += f.down[static_cast<std::size_t>(k / 4)] * f.across[static_cast<std::size_t>(k % 4)] *
                 Eigen::Vector2d(c[0], c[1]);
      }
    }
    found.push_back(s.pixel - model);
  }
  return found;
}

}  // namespace scanrig
