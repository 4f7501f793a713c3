#include "daemon/jobs/calibrator.h"

#include <array>
#include <map>
#include <system_error>
#include <utility>

#include "core/files.h"
#include "core/units.h"
#include "daemon/jobs/job_files.h"
#include "pipeline/calibration/corners/find_board.h"
#include "pipeline/calibration/corners/image_checks.h"
#include "pipeline/calibration/plan.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

class Calibrator final : public Reconstructor {
 public:
  Calibrator(CalibratorOptions options, CalibrationTask task) : options_(std::move(options)), task_(std::move(task)) {}

  Result<void> add_view(std::size_t pose, const RawView& raw, const ViewRecord& record, const Context&) override {
    const auto& placement = calibration_plan().at(pose);
    BoardPair pair{.name = fmt::format("placement {} image {}", pose + 1, record.index + 1),
                   .placement = placement.number,
                   .in_a = placement.in_a,
                   .in_b = placement.in_b,
                   .angle_rad = to_radians(record.measured_deg),
                   .left = {},
                   .right = {}};
    std::vector<std::string> problems;
    examine("left", raw.left_plain, raw.pixel_format, pair.left, problems);
    examine("right", raw.right_plain, raw.pixel_format, pair.right, problems);
    width_ = raw.left_plain.cols;
    height_ = raw.left_plain.rows;
    auto& views = good_[pose];
    views.erase(record.index);
    if (problems.empty()) views.emplace(record.index, std::move(pair));
    task_.report(static_cast<int>(pose), record.index, std::move(problems));
    return {};
  }

  Result<void> check_pose(std::size_t pose) override {
    const auto good = static_cast<int>(good_[pose].size());
    if (good >= task_.min_views) return {};
    return fail(ErrorCode::below_limits, "{} good view{}, {} are needed", good, good == 1 ? "" : "s", task_.min_views);
  }

  void drop_pose(std::size_t pose) override { good_.erase(pose); }
  Result<void> finish_pose(std::size_t, const Context&) override { return {}; }

  Result<void> finish(const fs::path& folder, const Context& context) override {
    CalibrationViews views{.pairs = {}, .width = width_, .height = height_};
    for (const auto& [pose, pairs] : good_) {
      for (const auto& [index, pair] : pairs) views.pairs.push_back(pair);
    }
    context.report("solving", 0.0);
    const auto solved = options_.solver(views, context);
    if (!solved) return pass_on(solved);
    context.report("solving", 1.0);
    if (solved->grade == "refused") {
      return fail(ErrorCode::below_limits, "the calibration does not grade: {}", fmt::join(solved->sentences, " "));
    }
    if (const auto read = parse_calibration(solved->file, folder / "calibration.json"); !read) return pass_on(read);
    return write(*solved, folder);
  }

 private:
  void examine(const char* side, const cv::Mat& image, const std::string& pixel_format, BoardSight& sight,
               std::vector<std::string>& problems) const {
    auto found = find_board(image, pixel_format, options_.board);
    if (!found) return problems.push_back(fmt::format("{}: {}", side, found.error().message));
    for (const auto& check : check_board_image(*found, options_.board, image.size())) {
      problems.push_back(fmt::format("{}: {}", side, check.message));
    }
    sight.corners = std::move(found->corners);
  }

  static Result<void> write(const CalibrationResult& solved, const fs::path& folder) {
    fs::path prepared = folder;
    prepared += ".new";
    std::error_code ignored;
    fs::remove_all(prepared, ignored);
    const auto report = calibration_report({.grade = solved.grade, .sentences = solved.sentences});
    const auto bytes = [](const std::string& text) { return std::as_bytes(std::span(text)); };
    const std::array<FileContent, 2> files{{{"calibration.json", bytes(solved.file)}, {"report.json", bytes(report)}}};
    auto done = create_directories_synced(prepared);
    if (done) done = write_files_synced(prepared, files);
    if (done) done = replace_folder(prepared, folder);
    if (!done) fs::remove_all(prepared, ignored);
    return done;
  }

  const CalibratorOptions options_;
  const CalibrationTask task_;
  std::map<std::size_t, std::map<int, BoardPair>> good_;  ///< by pose and view
  int width_ = 0, height_ = 0;
};

}  // namespace

CalibratorFactory calibrator(CalibratorOptions options) {
  return [options = std::move(options)](const CalibrationTask& task) {
    return std::make_unique<Calibrator>(options, task);
  };
}

}  // namespace scanrig
