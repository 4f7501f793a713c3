#include "pipeline/calibration/solve/solve_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "core/statistics.h"
#include "pipeline/calibration/solve/solution.h"

namespace scanrig {
namespace {

constexpr double kBlurred = 1.6;        ///< times the camera's median blur
constexpr double kBadImage = 3.0;       ///< times the median residual of all
constexpr int kMaxRounds = 5;           ///< of leaving images out
constexpr int kFew = 3;                 ///< images that do not fit by themselves; more have a reason in common
constexpr double kFieldEvidence = 3.0;  ///< chi-square per coefficient
constexpr double kCoarse = 1e-4, kMiddle = 1e-6, kFine = 1e-9;  ///< tolerance of the bundle
constexpr double kMadToSigma = 1.4826;

Result<void> check_length(const std::optional<MeasuredLength>& length, const Board& board) {
  if (!length) return {};
  if (length->corners) {
    const auto [from, to] = *length->corners;
    if (from == to || std::min(from, to) < 0 || std::max(from, to) >= board.corner_count()) {
      return fail(ErrorCode::invalid_input,
                  "calibration: a measured length joins corners {} and {}, which are not two "
                  "of the board's {}",
                  from, to, board.corner_count());
    }
  }
  const std::array<double, 3> values = {length->nominal_mm, length->measured_mm, length->sigma_mm};
  if (std::ranges::all_of(values, [](double mm) { return std::isfinite(mm) && mm > 0.0; })) return {};
  return fail(ErrorCode::invalid_input,
              "calibration: a measured length and its uncertainty must be finite and over 0 mm");
}

Result<void> check_sight(const CalibrationInput& input, const BoardPair& pair, const BoardSight& sight) {
  std::set<int> seen;
  for (const CornerObservation& corner : sight.corners) {
    const bool known = corner.id >= 0 && corner.id < input.board.corner_count() && seen.insert(corner.id).second;
    if (known && corner.pixel.allFinite()) continue;
    return fail(ErrorCode::invalid_input, "calibration: {}: corner {} is not one of the board's, or twice", pair.name,
                corner.id);
  }
  return {};
}

Result<void> check_input(const CalibrationInput& input) {
  if (input.width < 16 || input.height < 16 || !(input.nominal_focal_px > 1.0)) {
    return fail(ErrorCode::invalid_input, "calibration: needs image size and nominal focal length");
  }
  if (input.cameras < 1 || input.cameras > 2 || input.board.corner_columns() < 3 || input.board.corner_rows() < 3) {
    return fail(ErrorCode::invalid_input, "calibration: needs one or two cameras and a board of 4 x 4 squares or more");
  }
  for (const auto& length : {input.length, input.second_length}) {
    if (auto fine = check_length(length, input.board); !fine) return fine;
  }
  for (const BoardPair& pair : input.pairs) {
    for (const BoardSight* sight : {&pair.left, &pair.right}) {
      if (auto fine = check_sight(input, pair, *sight); !fine) return fine;
    }
  }
  return {};
}

const BoardSight& sight_of(const BoardPair& pair, std::size_t camera) { return camera == 0 ? pair.left : pair.right; }

class CalibrationSolver {
 public:
  CalibrationSolver(const CalibrationInput& input, const Context& context) : input_(input), context_(context) {}

  Result<CalibrationSolution> solve() {
    choose_images();
    auto start = find_start(input_, made_.used);
    if (!start) return pass_on(start);
    made_.start = std::move(*start);
    if (auto solved = run(0.1, kCoarse); !solved) return pass_on(solved);
    if (auto cleaned = leave_out(); !cleaned) return pass_on(cleaned);
    if (auto chosen = choose_lens(); !chosen) return pass_on(chosen);
    made_.solved.steps = steps_;
    if (auto described = describe_solution(input_, made_); !described) return pass_on(described);
    describe_images(input_, made_, reasons_, made_.solved);
    context_.report("calibration", 1.0);
    return std::move(made_);
  }

 private:
  void choose_images() {
    made_.used.assign(input_.pairs.size(), {false, false});
    reasons_.resize(input_.pairs.size());
    for (std::size_t c = 0; c < static_cast<std::size_t>(input_.cameras); ++c) {
      std::vector<double> blurs(input_.pairs.size(), 0.0), seen;
      for (std::size_t k = 0; k < input_.pairs.size(); ++k) {
        std::vector<double> of_image;
        for (const auto& corner : sight_of(input_.pairs[k], c).corners) of_image.push_back(corner.blur_px);
        if (of_image.empty()) continue;
        blurs[k] = quantile(of_image, 0.5);
        seen.push_back(blurs[k]);
      }
      const double limit = seen.empty() ? 0.0 : kBlurred * quantile(seen, 0.5);
      for (std::size_t k = 0; k < input_.pairs.size(); ++k) {
        const BoardSight& sight = sight_of(input_.pairs[k], c);
        const bool dots_only = sight.corners.empty() && !sight.dots.empty();
        if (sight.corners.size() < kMinCornersOfBoard && !dots_only) {
          reasons_[k][c] = "too few corners";
        } else if (limit > 0.0 && blurs[k] > limit) {
          reasons_[k][c] = "blurred";
        }
        made_.used[k][c] = reasons_[k][c].empty();
      }
    }
  }

  [[nodiscard]] BundleSetup& setup() { return made_.start.setup; }

  Result<void> run(double progress, double tolerance) {
    context_.report("calibration", progress);
    const auto steps = adjust(setup(), made_.start.unknowns, tolerance, context_);
    if (!steps) return pass_on(steps);
    steps_ += *steps;
    measure_noise(setup(), made_.start.unknowns);
    return {};
  }

  /// Marks the worse image of each pair that does not fit.
  [[nodiscard]] int mark_bad_images() {
    SolvedCalibration fits;
    describe_images(input_, made_, reasons_, fits);
    const auto count = static_cast<std::size_t>(input_.cameras);
    const double limit = std::max(kBadImage * fits.median_px, 0.02);
    int marked = 0;
    for (std::size_t k = 0; k < input_.pairs.size(); ++k) {
      std::size_t worst = 0;
      for (std::size_t c = 1; c < count; ++c) {
        const bool worse = made_.used[k][c] && fits.images[k * count + c].median_px > fits.images[k * count].median_px;
        if (worse || !made_.used[k][0]) worst = c;
      }
      if (!made_.used[k][worst] || !(fits.images[k * count + worst].median_px > limit)) continue;
      made_.used[k][worst] = false;
      reasons_[k][worst] = fmt::format("does not fit ({:.2f} px)", fits.images[k * count + worst].median_px);
      ++marked;
    }
    return marked;
  }

  /// Keeps the solution as it is now, for the search for what changed.
  Result<void> keep_whole() {
    auto whole = std::make_shared<CalibrationSolution>();
    whole->used = made_.used;
    whole->start = made_.start;
    auto linear = linearise(whole->start.setup, whole->start.unknowns);
    if (!linear) return pass_on(linear);
    auto normal = NormalMatrix::factorise(*linear);
    if (!normal) return pass_on(normal);
    whole->linear = std::move(*linear);
    whole->normal = std::move(*normal);
    made_.before_leaving_out = std::move(whole);
    return {};
  }

  Result<void> leave_out() {
    if (auto again = run(0.3, kCoarse); !again) return again;
    const auto all = made_.start;
    const UsedImages used = made_.used;
    const auto reasons = reasons_;
    int left_out = 0;
    for (int round = 0; round < kMaxRounds; ++round) {
      const int marked = mark_bad_images();
      if (marked == 0) break;
      left_out += marked;
      if (left_out > kFew && !made_.before_leaving_out) {
        const auto now = std::exchange(made_.start, all);
        auto kept = keep_whole();
        made_.start = now;
        if (!kept) return kept;
      }
      if (3 * left_out > input_.cameras * static_cast<int>(input_.pairs.size())) {
        made_.does_not_fit = true;
        made_.start = all;
        made_.used = used;
        reasons_ = reasons;
        return {};
      }
      setup().sightings = collect_sightings(input_, made_.used, made_.start.dot_ids);
      if (auto again = run(0.5, kCoarse); !again) return again;
    }
    return {};
  }

  Result<void> choose_lens() {
    if (input_.lens_field && !*input_.lens_field) return run(0.7, kFine);
    if (auto plain = run(0.6, kMiddle); !plain) return plain;
    Unknowns without = made_.start.unknowns;
    BundleSetup plain = setup();
    setup().with_field = true;
    if (auto with = run(0.7, kMiddle); !with) return with;
    plain.sigma_px = setup().sigma_px;
    plain.dot_sigma_px = setup().dot_sigma_px;
    const double gain = robust_chi2(plain, without) - robust_chi2(setup(), made_.start.unknowns);
    made_.solved.field_evidence = gain / (2.0 * LensField::kCount * input_.cameras);
    if (!input_.lens_field && made_.solved.field_evidence <= kFieldEvidence) {
      setup().with_field = false;
      made_.start.unknowns = without;
    }
    return run(0.9, kFine);
  }

  const CalibrationInput& input_;
  const Context& context_;
  CalibrationSolution made_;
  std::vector<std::array<std::string, 2>> reasons_;
  int steps_ = 0;
};

}  // namespace

void measure_noise(BundleSetup& setup, const Unknowns& u) {
  std::vector<double> corners, dots;
  const auto residuals = misses(setup, u);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    auto& into = setup.sightings[i].is_dot ? dots : corners;
    into.push_back(std::abs(residuals[i].x()));
    into.push_back(std::abs(residuals[i].y()));
  }
  const auto sigma = [](const std::vector<double>& values, double unknowns) {
    const auto count = static_cast<double>(values.size());
    return std::max(1e-4, kMadToSigma * quantile(values, 0.5) * std::sqrt(count / std::max(1.0, count - unknowns)));
  };
  const double poses = 6.0 * static_cast<double>(u.placements.size() + u.motions.size()) + 30.0;
  setup.sigma_px = sigma(corners, std::min(poses, 0.5 * static_cast<double>(corners.size())));
  if (!dots.empty()) setup.dot_sigma_px = sigma(dots, 2.0 * static_cast<double>(u.dots.size()));
}

Result<CalibrationSolution> solve_whole(const CalibrationInput& input, const Context& context) {
  if (auto fine = check_input(input); !fine) return pass_on(fine);
  return CalibrationSolver(input, context).solve();
}

Result<CalibrationSolution> solve_part(const CalibrationSolution& whole, const std::vector<bool>& pairs,
                                       const Context& context) {
  CalibrationSolution part;
  part.start = whole.start;
  part.used = whole.used;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (!pairs[k]) part.used[k] = {false, false};
  }
  const CalibrationInput& input = *whole.start.setup.input;
  BundleSetup& setup = part.start.setup;
  setup.sightings = collect_sightings(input, part.used, part.start.dot_ids);
  std::erase_if(setup.heights, [&](const KnownHeight& height) {
    return std::none_of(setup.sightings.begin(), setup.sightings.end(), [&](const Sighting& s) {
      return !s.is_dot && setup.placement_of_pair[static_cast<std::size_t>(s.pair)] == height.placement;
    });
  });
  const auto steps = adjust(setup, part.start.unknowns, kFine, context);
  if (!steps) return pass_on(steps);
  part.solved.steps = *steps;
  if (auto described = describe_solution(input, part); !described) return pass_on(described);
  return part;
}

Result<SolvedCalibration> solve_calibration(const CalibrationInput& input, const Context& context) {
  auto solution = solve_whole(input, context);
  if (!solution) return pass_on(solution);
  if (solution->does_not_fit) {
    return fail(ErrorCode::degenerate,
                "calibration: more than a third of the images do not fit; check board layout and table angles");
  }
  return std::move(solution->solved);
}

}  // namespace scanrig
