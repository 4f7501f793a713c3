#include "daemon/jobs/job_files.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <system_error>
#include <tuple>

#include "core/files.h"
#include "core/max_poses.h"
#include "core/strict_json.h"
#include "core/timestamp.h"
#include "pipeline/storage/pose_choices.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kJob = "job.json";
constexpr const char* kCheck = "calibration_check.json";
constexpr const char* kLive = "live";
constexpr const char* kFailure = "failure.json";
constexpr const char* kAttempt = "attempt.json";
constexpr int kMaxScanPoses = static_cast<int>(kMaxPoses);
constexpr int kJobVersion = 3;  ///< 1 had other names for some keys of the recipe, 2 no calibrations

/// Part ids and messages come from outside and need not be UTF-8.
Result<void> write_json(const fs::path& file, const ordered_json& json) {
  return write_file_atomically(file, json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n");
}

void remove_file(const fs::path& file) {
  std::error_code ignored;  // a remaining file is found again at the next start
  fs::remove(file, ignored);
}

ordered_json to_json(const Recipe& recipe) {
  ordered_json limits = ordered_json::object();
  if (recipe.limits.min_measured_share) limits["min_measured_share"] = *recipe.limits.min_measured_share;
  if (recipe.limits.max_residual_mm) limits["max_residual_mm"] = *recipe.limits.max_residual_mm;
  return {{"kind", to_string(recipe.kind)},
          {"name", recipe.name},
          {"poses", recipe.poses},
          {"views", recipe.views},
          {"flip_timeout_min", recipe.flip_timeout.count()},
          {"flip_by_signal", recipe.flip_by_signal},
          {"start_on_part", recipe.start_on_part},
          {"fixture", recipe.fixture},
          {"limits", limits}};
}

Recipe read_recipe(JsonObject object, int version) {
  const bool old_names = version < 2;
  const char* const min_share = old_names ? "least_measured_share" : "min_measured_share";  // old name
  const char* const max_residual = old_names ? "most_residual_mm" : "max_residual_mm";      // old name
  Recipe recipe;
  recipe.name = object.text("name");
  if (version >= 3) {
    const auto kind = object.one_of("kind", {"scan", "calibration", "check"});
    recipe.kind = static_cast<RecipeKind>(std::ranges::find(kRecipeKinds, kind) - kRecipeKinds.begin());
  }
  recipe.poses =
      object.integer("poses", 1, recipe.is_calibration() ? static_cast<int>(calibration_plan().size()) : kMaxScanPoses);
  recipe.views = object.integer("views", 1, 360);
  recipe.flip_timeout = std::chrono::minutes(object.integer("flip_timeout_min", 1, 1440));
  recipe.flip_by_signal = object.flag(old_names ? "flip_by_line" : "flip_by_signal");  // old name
  recipe.start_on_part = object.flag("start_on_part");
  if (object.has("fixture")) recipe.fixture = object.flag("fixture");  // earlier jobs have none
  JsonObject limits = object.object("limits");
  if (limits.has(min_share)) recipe.limits.min_measured_share = limits.number(min_share, 0, 1);
  if (limits.has(max_residual)) recipe.limits.max_residual_mm = limits.number(max_residual, 0, 1000);
  limits.close();
  object.close();
  return recipe;
}

/// Distinguishes this run of the daemon from all others; process ids repeat.
const std::string& this_process() {
  static const std::string name = [] {
    std::random_device random;
    return fmt::format("{:08x}{:08x}", random(), random());
  }();
  return name;
}

/// Null where `json` is not an object or has no such member.
nlohmann::json member(const nlohmann::json& json, const char* key) {
  return json.is_object() ? json.value(key, nlohmann::json()) : nlohmann::json();
}

std::optional<double> number_at(const nlohmann::json& json, const char* key) {
  const auto value = member(json, key);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

/// The worst pose's median distance between its views.
std::optional<double> residual_mm(const nlohmann::json& report) {
  std::optional<double> worst;
  for (const auto& pose : member(report, "poses")) {
    const auto here = number_at(pose, "residual_median_mm");
    if (!here) return std::nullopt;
    worst = std::max(worst.value_or(0.0), *here);
  }
  return worst;
}

}  // namespace

fs::path model_folder(const fs::path& job_folder) { return job_folder / "model"; }
fs::path model_file(const fs::path& job_folder, RecipeKind kind) {
  return model_folder(job_folder) / (kind == RecipeKind::scan ? "model.glb" : "calibration.json");
}
/// Not synced: nothing needs it after a power cut. A client that reads it by its name reads the whole.
Result<void> write_live_file(const fs::path& job_folder, const std::string& name, std::string_view bytes) {
  const auto file = job_folder / kLive / name;
  const auto half = job_folder / kLive / (name + ".tmp");
  std::error_code error;
  fs::create_directory(file.parent_path(), error);
  std::ofstream out(half, std::ios::binary);
  out << bytes;
  out.close();
  if (out.good()) fs::rename(half, file, error);
  if (out.good() && !error) return {};
  remove_file(half);
  return fail(ErrorCode::io, "cannot write {}", file.string());
}

void remove_live_files(const fs::path& job_folder) {
  std::error_code ignored;  // removed with the job
  fs::remove_all(job_folder / kLive, ignored);
}

fs::path report_file(const fs::path& job_folder) { return model_folder(job_folder) / "report.json"; }

FolderSize measure_folder(const fs::path& folder) {
  FolderSize size;
  std::error_code error;
  for (fs::recursive_directory_iterator next(folder, error), end; !error && next != end; next.increment(error)) {
    std::error_code ignored;
    const auto bytes = next->file_size(ignored);
    ++size.files;
    if (!ignored) size.bytes += bytes;
  }
  return size;
}

Result<void> write_job_file(const fs::path& job_folder, const JobFile& job) {
  ordered_json json = {{"format", "scanrig-job"},      {"version", kJobVersion},   {"part", job.part},
                       {"place", job.place},           {"exported", job.exported}, {"accepted", job.accepted},
                       {"recipe", to_json(job.recipe)}};
  if (job.whole_poses > 0) json["whole_poses"] = job.whole_poses;
  return write_json(job_folder / kJob, json);
}

Result<JobFile> read_job_file(const fs::path& job_folder) {
  auto json = JsonFile::read(job_folder / kJob, "scanrig-job", kJobVersion, 1);
  if (!json && json.error().code == ErrorCode::not_found) return JobFile{};
  if (!json) return pass_on(json);
  JobFile job;
  job.part = json->root().text("part");
  job.place = json->root().integer("place", -1'000'000'000, 1'000'000'000);
  job.exported = json->root().flag("exported");
  if (json->version() >= 3) job.accepted = json->root().flag("accepted");
  job.recipe = read_recipe(json->root().object("recipe"), json->version());
  if (json->root().has("whole_poses")) job.whole_poses = json->root().integer("whole_poses", 1, kMaxScanPoses);
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  return job;
}

Result<void> set_accepted(const fs::path& job_folder, bool accepted) {
  auto job = read_job_file(job_folder);
  if (!job) return pass_on(job);
  job->accepted = accepted;
  return write_job_file(job_folder, *job);
}

Result<void> write_failure(const fs::path& job_folder, const Error& error) {
  return write_json(job_folder / kFailure, {{"code", to_string(error.code)}, {"message", error.message}});
}

std::optional<Error> read_failure(const fs::path& job_folder) {
  const auto text = read_file(job_folder / kFailure);
  if (!text) return std::nullopt;
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("message") || !json["message"].is_string()) return std::nullopt;
  const auto code = json.contains("code") && json["code"].is_string()
                        ? parse_error_code(json["code"].get<std::string>())
                        : std::nullopt;
  return Error{code.value_or(ErrorCode::internal), json["message"]};
}

void remove_failure(const fs::path& job_folder) { remove_file(job_folder / kFailure); }

AttemptRecord read_attempt_record(const fs::path& job_folder) {
  auto json = JsonFile::read(job_folder / kAttempt, "scanrig-attempt", 1);
  if (!json) return {};
  const int count = json->root().integer("count", 1, 1000);
  const bool running = json->root().text("process") == this_process();
  if (!json->finish()) return {};
  return {running ? count - 1 : count, running};
}

Result<void> begin_attempt(const fs::path& job_folder) {
  return write_json(job_folder / kAttempt, {{"format", "scanrig-attempt"},
                                            {"version", 1},
                                            {"count", read_attempt_record(job_folder).ended_by_death + 1},
                                            {"process", this_process()}});
}

void forget_attempts(const fs::path& job_folder) { std::ignore = remove_file_synced(job_folder / kAttempt); }

std::string calibration_report(const CalibrationOutcome& outcome) {
  ordered_json json = {{"format", "scanrig-calibration-report"},
                       {"version", 1},
                       {"grade", outcome.grade},
                       {"sentences", outcome.sentences}};
  if (!outcome.verdict.empty()) json["verdict"] = outcome.verdict;
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::optional<CalibrationOutcome> read_calibration_report(const fs::path& report) {
  auto json = JsonFile::read(report, "scanrig-calibration-report", 1);
  if (!json) return std::nullopt;
  CalibrationOutcome outcome;
  outcome.grade = json->root().text("grade");
  outcome.sentences = json->root().texts("sentences");
  if (json->root().has("verdict")) outcome.verdict = json->root().text("verdict");
  if (!json->finish()) return std::nullopt;
  return outcome;
}

Result<void> note_check(const fs::path& root, const std::string& calibration_sha256) {
  return write_json(root / kCheck, {{"format", "scanrig-calibration-check"},
                                    {"version", 1},
                                    {"calibration_sha256", calibration_sha256},
                                    {"date", iso_time(std::chrono::system_clock::now())}});
}

std::string last_check(const fs::path& root, const std::string& calibration_sha256) {
  auto json = JsonFile::read(root / kCheck, "scanrig-calibration-check", 1);
  if (!json) return "";
  const bool is_of_this = json->root().sha256("calibration_sha256") == calibration_sha256;
  const auto date = json->root().text("date");
  return json->finish() && is_of_this ? date : "";
}

std::vector<std::string> read_remarks(const fs::path& report) {
  const auto text = read_file(report);
  const auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  std::vector<std::string> remarks;
  if (!json.is_object()) return remarks;
  const auto add = [&remarks](const nlohmann::json& sentence) {
    if (sentence.is_string() && std::ranges::count(remarks, sentence.get<std::string>()) == 0) {
      remarks.push_back(sentence);
    }
  };
  for (const auto& pose : member(json, "poses")) {
    for (const auto& sentence : member(member(pose, "watch"), "sentences")) add(sentence);
  }
  for (const auto& disagreement : member(json, "disagreements")) add(member(disagreement, "sentence"));
  add(member(member(member(json, "pose_estimate"), "turn"), "sentence"));
  const auto refinement = member(json, "pose_refinement");
  add(member(refinement, "sentence"));
  for (const auto& pose : member(refinement, "poses")) add(member(pose, "sentence"));
  add(member(member(json, "next_rest"), "sentence"));
  return remarks;
}

void take_choices(JobInfo& job) {
  job.choices.clear();
  job.picked = 0;
  const auto stored = read_choices(job.folder);
  if (!stored) return;
  job.picked = stored->picked;
  for (const auto& choice : stored->choices) {
    const int number = static_cast<int>(job.choices.size()) + 1;
    job.choices.push_back({choice.sentence, choice.has_image ? choice_image(number) : ""});
  }
}

std::optional<Error> limit_violation(const fs::path& report, const Limits& limits) {
  if (limits == Limits{}) return std::nullopt;
  const auto text = read_file(report);
  const auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  if (!json.is_object()) return Error{ErrorCode::invalid_input, report.string() + ": cannot be read"};
  const auto residual = residual_mm(json), share = number_at(member(json, "mesh"), "measured_share");
  if (limits.min_measured_share && share.value_or(0.0) < *limits.min_measured_share) {
    return Error{ErrorCode::below_limits,
                 fmt::format("{:.1f} % of the surface was measured, the recipe asks for {:.1f}",
                             100 * share.value_or(0.0), 100 * *limits.min_measured_share)};
  }
  if (limits.max_residual_mm && residual.value_or(1e9) > *limits.max_residual_mm) {
    return Error{ErrorCode::below_limits,
                 fmt::format("the views of a pose are {:.3f} mm apart, the recipe allows {:.3f}",
                             residual.value_or(1e9), *limits.max_residual_mm)};
  }
  return std::nullopt;
}

}  // namespace scanrig
