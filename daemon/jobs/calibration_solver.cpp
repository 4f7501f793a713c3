#include "daemon/jobs/executors.h"

#include <utility>

#include "core/files.h"
#include "core/hash.h"
#include "core/timestamp.h"
#include "pipeline/calibrate/calibration_json.h"
#include "pipeline/calibrate/report/calibration_html.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig {
namespace {

CalibrationOrigin origin_of(const CalibrationImages& images, std::string previous) {
  CalibrationOrigin origin;
  origin.date = iso_time(std::chrono::system_clock::now());
  origin.previous = std::move(previous);
  for (const CalibrationPair& pair : images.pairs) {
    for (std::size_t side = 0; side < pair.files.size(); ++side) {
      origin.sources.emplace_back(pair.files[side].lexically_relative(images.folder).string(), pair.sha256[side]);
    }
  }
  return origin;
}

/// Compares the views with the calibration that the job was begun with.
Result<CalibrationResult> check_views(const CalibrationViews& views, const CalibrateOptions& options,
                                      const std::string& previous, const Context& context) {
  const auto file = views.images.folder / "calibration.json";
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  const auto known = parse_calibration(*text, file);
  if (!known) return pass_on(known);
  const auto check = check_drift(*known, options.board.value_or(Board{}), views.boards.pairs, context);
  if (!check) return pass_on(check);
  CalibrationResult result{.grade = known->quality->grade,
                           .verdict = std::string(to_string(check->verdict)),
                           .sentences = check->sentences,
                           .file = *text};
  if (check->verdict != DriftVerdict::moved) return result;
  auto moved = moved_calibration_json(*text, *check, origin_of(views.images, previous));
  if (!moved) return pass_on(moved);
  result.file = std::move(*moved);
  return result;
}

}  // namespace

CalibrationSolver calibration_solver(CalibrateOptions options, std::filesystem::path rig_calibration) {
  return [options = std::move(options), rig_calibration = std::move(rig_calibration)](
             CalibrationViews views, const Context& context) -> Result<CalibrationResult> {
    const auto there = read_file(rig_calibration);
    const std::string previous = there ? sha256(*there) : std::string();
    if (views.is_check) return check_views(views, options, previous, context);
    const auto outcome = calibrate_boards(views.images, std::move(views.boards), options, context);
    if (!outcome) return pass_on(outcome);
    const CalibrationJudgement& judgement = outcome->judged.judgement;
    const CalibrationOrigin origin = origin_of(views.images, previous);
    CalibrationResult result{.grade = std::string(to_string(judgement.grade)),
                             .sentences = judgement.sentences,
                             .html = calibration_html(*outcome, origin)};
    if (judgement.grade == CalibrationGrade::refused) return result;
    auto text = calibration_json(*outcome, origin);
    if (!text) return pass_on(text);
    result.file = std::move(*text);
    return result;
  };
}

}  // namespace scanrig
