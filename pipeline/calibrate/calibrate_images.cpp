#include "pipeline/calibrate/calibrate_images.h"

#include <algorithm>

#include "core/parallel.h"
#include "pipeline/calibration/corners/rim_dots.h"
#include "pipeline/calibration/solve/focal_length.h"

namespace scanrig {
namespace {

constexpr double kFocalPerWidth = 1.2;  ///< where nothing tells it
constexpr double kTableRadiusMm = 90.0;
constexpr std::size_t kMinDotImages = 6;  ///< fewer show the rim too seldom to be worth it
constexpr double kPrintErrorMm = 1.0;     ///< of a dot along the rim, while its place is not known

std::string pixel_format_of(const CalibrationImages& images, const CalibrateOptions& options) {
  if (!options.pixel_format.empty()) return options.pixel_format;
  if (!images.pixel_format.empty()) return images.pixel_format;
  for (const CalibrationPair& pair : images.pairs) {
    if (const auto image = load_calibration_image(pair, 0)) return image->channels() == 1 ? "Mono8" : "BGR8";
  }
  return "Mono8";
}

/// The first one: others on the same board measure its print, not the instrument.
std::optional<MeasuredLength> listed_length(const CalibrationImages& images, const Board& board) {
  if (images.lengths.empty()) return std::nullopt;
  const BoardLength& length = images.lengths.front();
  return MeasuredLength{(board.corner(length.to) - board.corner(length.from)).norm(), length.mm, length.sigma_mm,
                        std::array<int, 2>{length.from, length.to}};
}

CalibrationInput input_of(const CalibrationImages& images, const CalibrateOptions& options, const Board& board,
                          const FoundBoards& boards) {
  CalibrationInput input;
  input.form = images.is_on_table() ? CalibrationInput::Form::table : CalibrationInput::Form::hand_held;
  input.board = board;
  input.board_kind = options.board_kind;
  input.pairs = boards.pairs;
  input.width = boards.width;
  input.height = boards.height;
  const double listed = (images.focal_px[0] + images.focal_px[1]) / 2.0;
  input.nominal_focal_px = options.focal_px > 0.0 ? options.focal_px : listed;
  if (!(input.nominal_focal_px > 0.0)) {
    const auto found = find_focal_px(board, boards.pairs, boards.width, boards.height);
    input.nominal_focal_px = found.value_or(kFocalPerWidth * boards.width);
  }
  input.serials = images.serials;
  const double radius = options.table_radius_mm > 0.0 ? options.table_radius_mm : images.table_radius_mm.value_or(0.0);
  input.table_radius_mm = radius > 0.0 ? radius : kTableRadiusMm;
  input.gear_ratio = options.gear_ratio;
  input.length = options.length ? options.length : listed_length(images, board);
  input.second_length = options.second_length;
  input.lens_field = options.lens_field;
  return input;
}

/// Dots of every image, by the cameras as solved without them.
Result<std::size_t> measure_dots(const CalibrationImages& images, const std::string& format,
                                 const FolderCalibration& first, CalibrationInput& input, const Context& context) {
  const SolvedCalibration& solved = first.judged.solved;
  std::vector<std::size_t> dots(2 * images.pairs.size(), 0);
  context.report("rim dots", 0.0);
  if (context.stopped()) return fail(ErrorCode::stopped, "calibration: stopped on request");
  parallel_for(dots.size(), [&](std::size_t i) {
    const CalibrationPair& pair = images.pairs[i / 2];
    const auto image = load_calibration_image(pair, i % 2);
    if (!image) return;
    RimDotOptions how;
    how.search_along_mm = kPrintErrorMm;
    const auto& outline = first.boards.outlines[i / 2][i % 2];
    if (!outline.empty()) how.hidden_by = {outline};
    const Camera& camera = i % 2 == 0 ? solved.calibration.left : solved.calibration.right;
    const double angle = solved.table.gear * input.pairs[i / 2].angle_rad;
    auto found = find_rim_dots(*image, format, camera, input.rim_dots, angle, how);
    if (!found) return;
    dots[i] = found->dots.size();
    (i % 2 == 0 ? input.pairs[i / 2].left : input.pairs[i / 2].right).dots = std::move(found->dots);
  });
  context.report("rim dots", 1.0);
  return static_cast<std::size_t>(std::ranges::count_if(dots, [](std::size_t count) { return count > 0; }));
}

Board board_of(const CalibrationImages& images, const CalibrateOptions& options) {
  return options.board ? *options.board : images.board.value_or(Board{});
}

Result<FolderCalibration> calibrate(const CalibrationImages& images, FoundBoards boards,
                                    const CalibrateOptions& options, const Context& context) {
  const Board board = board_of(images, options);
  const std::string format = pixel_format_of(images, options);
  FolderCalibration outcome;
  outcome.boards = std::move(boards);
  outcome.input = input_of(images, options, board, outcome.boards);
  auto judged = judge_calibration(outcome.input, context);
  if (!judged) return pass_on(judged);
  outcome.judged = std::move(*judged);

  const auto rim = options.rim_dots ? options.rim_dots : images.rim_dots;
  if (!rim || !images.is_on_table()) return outcome;
  CalibrationInput with_dots = outcome.input;
  with_dots.rim_dots = *rim;
  const auto seen = measure_dots(images, format, outcome, with_dots, context);
  if (!seen) return pass_on(seen);
  if (*seen < kMinDotImages) return outcome;
  auto again = judge_calibration(with_dots, context);
  if (!again) return pass_on(again);
  outcome.input = std::move(with_dots);
  outcome.judged = std::move(*again);
  return outcome;
}

}  // namespace

Result<FolderCalibration> calibrate_boards(const CalibrationImages& images, FoundBoards boards,
                                           const CalibrateOptions& options, const Context& context) {
  Result<FolderCalibration> outcome = fail(ErrorCode::internal, "calibration: not run");
  with_threads(options.threads, [&] { outcome = calibrate(images, std::move(boards), options, context); });
  return outcome;
}

Result<FolderCalibration> calibrate_images(const CalibrationImages& images, const CalibrateOptions& options,
                                           const Context& context) {
  Result<FoundBoards> boards = fail(ErrorCode::internal, "calibration: not run");
  with_threads(options.threads, [&] {
    boards = find_boards(images, pixel_format_of(images, options), board_of(images, options), context);
  });
  if (!boards) return pass_on(boards);
  return calibrate_boards(images, std::move(*boards), options, context);
}

}  // namespace scanrig
