#include "daemon/jobs/calibrator.h"

#include <algorithm>
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
    const CalibrationPair planned = calibration_pair(task_.folder, pose, record);
    GoodView view;
    view.boards.name = planned.name;
    view.boards.placement = planned.placement;
    view.boards.in_a = planned.in_a;
    view.boards.in_b = planned.in_b;
    view.boards.angle_rad = to_radians(record.measured_deg);
    std::vector<std::string> problems;
    const bool is_left_good =
        examine("left", raw.left_plain, raw.pixel_format, view.boards.left, view.outlines[0], problems);
    const bool is_right_good =
        examine("right", raw.right_plain, raw.pixel_format, view.boards.right, view.outlines[1], problems);
    size_ = raw.left_plain.size();
    auto& views = good_[pose];
    views.erase(record.index);
    if (is_left_good && is_right_good) views.emplace(record.index, std::move(view));
    task_.report(static_cast<int>(pose), record.index, std::move(problems));
    return {};
  }

  Result<void> check_pose(std::size_t pose) override {
    const auto good = static_cast<int>(good_[pose].size());
    const int needed = calibration_plan().at(pose).is_flat() ? kMinFlatViews : kMinPlacementViews;
    if (good >= needed) return {};
    return fail(ErrorCode::below_limits, "{} good view{}, {} are needed", good, good == 1 ? "" : "s", needed);
  }

  void drop_pose(std::size_t pose) override { good_.erase(pose); }
  Result<void> finish_pose(std::size_t, const Context&) override { return {}; }

  Result<void> finish(const fs::path& folder, const Context& context) override {
    auto views = good_views();
    if (!views) return pass_on(views);
    const auto solved = options_.solver(std::move(*views), context);
    if (!solved) return pass_on(solved);
    if (!solved->html.empty()) {
      if (auto told = write_file_atomically(task_.folder / "calibration.html", solved->html); !told) return told;
    }
    if (solved->grade == "refused") {
      return fail(ErrorCode::below_limits, "the calibration does not grade: {}", fmt::join(solved->sentences, " "));
    }
    const auto read = parse_calibration(solved->file, folder / "calibration.json");
    if (!read) return pass_on(read);
    if (auto written = write(*solved, folder); !written || solved->verdict != "holds") return written;
    return note_check(task_.folder.parent_path(), read->sha256);
  }

 private:
  struct GoodView {
    BoardPair boards;
    std::array<std::vector<Eigen::Vector2d>, 2> outlines;
  };

  /// The stored images of the good views. Fails as read_calibration_images().
  [[nodiscard]] Result<CalibrationViews> good_views() const {
    auto stored = read_calibration_images(task_.folder);
    if (!stored) return pass_on(stored);
    CalibrationViews all{.is_check = task_.is_check, .images = std::move(*stored), .boards = {}};
    auto pairs = std::exchange(all.images.pairs, {});
    all.images.serials = {options_.cameras.left, options_.cameras.right};
    all.boards.width = size_.width;
    all.boards.height = size_.height;
    for (const auto& [pose, views] : good_) {
      for (const auto& [index, view] : views) {
        const auto images = std::ranges::find(pairs, view.boards.name, &CalibrationPair::name);
        if (images == pairs.end()) return fail(ErrorCode::internal, "calibration: {} is not stored", view.boards.name);
        all.images.pairs.push_back(*images);
        all.boards.pairs.push_back(view.boards);
        all.boards.outlines.push_back(view.outlines);
      }
    }
    return all;
  }

  /// Finds the board and adds what makes the image a bad one; true: it is good. The report has the minor remarks.
  bool examine(const char* side, const cv::Mat& image, const std::string& pixel_format, BoardSight& sight,
               std::vector<Eigen::Vector2d>& outline, std::vector<std::string>& problems) const {
    auto found = find_board(image, pixel_format, options_.board);
    if (!found) {
      problems.push_back(fmt::format("{}: {}", side, found.error().message));
      return false;
    }
    const auto checks = check_board_image(*found, options_.board, image.size());
    for (const auto& check : checks) {
      if (!check.is_minor) problems.push_back(fmt::format("{}: {}", side, check.message));
    }
    outline.assign(found->outline.begin(), found->outline.end());
    sight.corners = std::move(found->corners);
    return std::ranges::all_of(checks, &ImageCheck::is_minor);
  }

  static Result<void> write(const CalibrationResult& solved, const fs::path& folder) {
    fs::path prepared = folder;
    prepared += ".new";
    std::error_code ignored;
    fs::remove_all(prepared, ignored);
    const auto report =
        calibration_report({.grade = solved.grade, .verdict = solved.verdict, .sentences = solved.sentences});
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
  std::map<std::size_t, std::map<int, GoodView>> good_;  ///< by pose and view
  cv::Size size_;
};

}  // namespace

CalibratorFactory calibrator(CalibratorOptions options) {
  return [options = std::move(options)](const CalibrationTask& task) {
    return std::make_unique<Calibrator>(options, task);
  };
}

}  // namespace scanrig
