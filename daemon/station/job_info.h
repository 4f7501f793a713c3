#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "daemon/station/states.h"
#include "pipeline/calibration/plan.h"

namespace scanrig {

/// Limits that a model must reach to pass.
struct Limits {
  std::optional<double> min_measured_share{};  ///< of the model's area that cameras saw, 0 to 1
  std::optional<double> max_residual_mm{};     ///< median distance between a pose's views, the worst pose
  bool operator==(const Limits&) const = default;
};

/// What the views of a job are for. The poses of a calibration are the placements of calibration_plan(); a check of the
/// calibration is its first placement alone.
enum class RecipeKind { scan, calibration, check };
inline constexpr std::array<std::string_view, 3> kRecipeKinds = {"scan", "calibration", "check"};
constexpr std::string_view to_string(RecipeKind kind) { return kRecipeKinds[static_cast<std::size_t>(kind)]; }

/// Settings for scanning one kind of object. A job keeps the recipe it was queued with.
struct Recipe {
  std::string name = "default";
  int poses = 2;
  int views = 8;                          ///< per pose, at equal angles; of a calibration as placement_angles() counts
  std::chrono::minutes flip_timeout{30};  ///< then the job is parked and the rig is free
  bool flip_by_signal = false;            ///< the panel's `flipped` input reports that the object was turned over
  bool start_on_part = false;             ///< the queue continues when `part_present` falls and rises again
  bool fixture = false;                   ///< the part stands on putty, pins or a magnet
  Limits limits{};
  RecipeKind kind = RecipeKind::scan;
  bool operator==(const Recipe&) const = default;

  /// Or a check of one: views of the board.
  [[nodiscard]] bool is_calibration() const { return kind != RecipeKind::scan; }
  [[nodiscard]] bool is_check() const { return kind == RecipeKind::check; }
  [[nodiscard]] const Placement& placement(int pose) const {
    const auto& plan = calibration_plan();
    return plan[std::min(static_cast<std::size_t>(pose), plan.size() - 1)];
  }
  [[nodiscard]] std::vector<double> angles_deg(int pose) const {
    if (is_calibration()) return placement_angles(placement(pose), views);
    std::vector<double> angles;
    for (int view = 0; view < views; ++view) angles.push_back(360.0 * view / views);
    return angles;
  }
  [[nodiscard]] int views_of(int pose) const {
    return is_calibration() && placement(pose).is_flat() ? views + 1 : views;
  }
  [[nodiscard]] int all_views() const {
    int all = 0;
    for (int pose = 0; pose < poses; ++pose) all += views_of(pose);
    return all;
  }
};

/// The recipe of every calibration.
inline Recipe calibration_recipe() {
  return {.name = "calibration",
          .poses = static_cast<int>(calibration_plan().size()),
          .views = kPlacementViews,
          .kind = RecipeKind::calibration};
}

/// The recipe of every check of a calibration.
inline Recipe check_recipe() {
  return {.name = "calibration check", .poses = 1, .views = kCheckViews, .kind = RecipeKind::check};
}

struct StoredView {
  int pose = 0;
  int view = 0;
  double measured_deg = 0.0;
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
  double commanded_deg = 0.0;
  double settling_ms = 0.0;  ///< from in-position to stopped
  /// Of a calibration: what is wrong with its images, for the operator; nothing: not examined yet.
  std::optional<std::vector<std::string>> problems{};
};

struct StageShare {
  std::string name;
  double fraction = 0.0;
};

/// Result of comparing view 0, taken again, with the views since: a movement check, or the check before a resume.
struct MovementCheck {
  int pose = 0;
  double shift_px = 0.0;                ///< of the visible image, the larger of both cameras
  double changed = 0.0;                 ///< share of the visible image that looks different, 0 to 1
  bool unmoved = true;                  ///< object, table and cameras are where they were
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
};

/// Result of a calibration, or of a check of one.
struct CalibrationOutcome {
  std::string grade{};    ///< "A", "B", "C"
  std::string verdict{};  ///< of a check: "holds", "moved" (new poses can be accepted), "calibrate"; else empty
  std::vector<std::string> sentences{};
  bool is_accepted = false;  ///< the rig's calibration was replaced by it
  bool operator==(const CalibrationOutcome&) const = default;
};

/// One way to lay the part down for the next pose, predicted from what its scan has measured.
struct SuggestedRest {
  std::string sentence{};                    ///< "Lay it on its back: shows 81 % of what is unseen."
  std::string doubt{};                       ///< why its pose may not be found; empty: it can be
  double gain = 0.0;                         ///< share of the unseen surface that it is expected to show
  double unseen_after = 0.0, overlap = 0.0;  ///< shares as in docs/reference/report.md
  bool has_image = false;                    ///< live/restN.png of the job, N from 1
  bool operator==(const SuggestedRest&) const = default;
};

/// One of several ways in which pose 2 fits, that give different surfaces; docs/reference/scan-folder.md.
struct JobChoice {
  std::string sentence{};
  std::string image{};  ///< its file in the job's folder; empty: not drawn
  bool operator==(const JobChoice&) const = default;
};

/// Name of its image among the live files of a job; `number` from 1.
inline std::string rest_image(int number) { return fmt::format("rest{}.png", number); }

/// Data of one job.
struct JobInfo {
  std::string id{};
  std::string folder{};
  JobState state = JobState::queued;
  Recipe recipe{};
  std::string part{};      ///< from the order: barcode text or what the operator typed; may be empty
  std::int64_t place = 0;  ///< in the queue: the smallest comes first
  int complete = 0;        ///< poses with all their views
  std::vector<StoredView> stored{};
  std::vector<std::string> config_sha256{};  ///< of each configuration they were taken under
  std::vector<MovementCheck> movement_checks{};
  bool quarantined = false;          ///< two daemons died during its reconstruction: only `reprocess` tries again
  bool exported = false;             ///< a client has fetched what it needs
  std::optional<bool> passed{};      ///< done: whether the model is within the recipe's limits
  std::vector<StageShare> stages{};  ///< of the reconstruction, in the order of their start
  std::optional<CalibrationOutcome> calibration{};  ///< of a calibration that is solved
  std::vector<std::string> live{};                  ///< meshes of what its scan shows so far, event::LiveMeshes
  std::vector<SuggestedRest> suggestions{};         ///< for the next pose, best first
  std::vector<JobChoice> choices{};                 ///< for the operator, where pose 2 fits in several ways
  int picked = 0;                                   ///< of these, from 1; 0: none
  std::string repeated{};              ///< why the views of the current placement were dropped; empty: they were not
  std::optional<Error> error{};        ///< why it failed, was interrupted or cancelled; or did not pass
  std::vector<std::string> remarks{};  ///< done: what its report says to a person
  std::string model{};                 ///< path of the model file, once it exists
  std::string report{};
};

/// Part of the scan exists, so it can only continue with the same settings.
inline bool has_views(const JobInfo& job) { return job.complete > 0 || !job.stored.empty(); }

/// A job that should have started, and why it did not.
struct NotStarted {
  std::string job;
  Error why;
};

}  // namespace scanrig
