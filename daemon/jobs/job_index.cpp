#include "daemon/jobs/job_index.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/hash.h"
#include "daemon/jobs/job_files.h"

namespace scanrig {
namespace {

constexpr int kLayout = 8;  ///< increase with every change below

nlohmann::json to_json(const std::optional<Error>& error) {
  if (!error) return nullptr;
  return {to_string(error->code), error->message};
}

nlohmann::json to_json(const std::vector<Error>& errors) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& error : errors) list.push_back(to_json(std::optional(error)));
  return list;
}

std::optional<Error> error_from(const nlohmann::json& j) {
  if (j.is_null()) return std::nullopt;
  return Error{parse_error_code(j.at(0).get<std::string>()).value_or(ErrorCode::internal), j.at(1)};
}

std::vector<Error> errors_from(const nlohmann::json& list) {
  std::vector<Error> errors;
  for (const auto& error : list) errors.push_back(error_from(error).value());
  return errors;
}

nlohmann::json views_of(const JobInfo& job) {
  nlohmann::json views = nlohmann::json::array();
  for (const auto& v : job.stored) {
    views.push_back({v.pose, v.view, v.measured_deg, to_json(v.retake_reasons), v.commanded_deg, v.settling_ms});
  }
  return views;
}

nlohmann::json choices_of(const JobInfo& job) {
  nlohmann::json choices = nlohmann::json::array();
  for (const auto& c : job.choices) choices.push_back({c.sentence, c.image});
  return choices;
}

nlohmann::json movement_checks_of(const JobInfo& job) {
  nlohmann::json movement_checks = nlohmann::json::array();
  for (const auto& c : job.movement_checks) {
    movement_checks.push_back({c.pose, c.shift_px, c.changed, c.unmoved, to_json(c.retake_reasons)});
  }
  return movement_checks;
}

void read(const nlohmann::json& j, JobInfo& job) {
  job.id = j.at("id");
  job.folder = j.at("folder");
  job.state = parse_job_state(j.at("state").get<std::string>()).value();
  job.complete = j.at("complete");
  job.quarantined = j.at("quarantined");
  if (!j.at("passed").is_null()) job.passed = j.at("passed").get<bool>();
  job.error = error_from(j.at("error"));
  job.model = j.at("model");
  job.report = j.at("report");
  job.remarks = j.at("remarks").get<std::vector<std::string>>();
  for (const auto& c : j.at("choices")) job.choices.push_back({c.at(0), c.at(1)});
  job.picked = j.at("picked");
  job.config_sha256 = j.at("config_sha256").get<std::vector<std::string>>();
  for (const auto& v : j.at("stored")) {
    job.stored.push_back({v.at(0), v.at(1), v.at(2), errors_from(v.at(3)), v.at(4), v.at(5)});
  }
  for (const auto& c : j.at("movement_checks")) {
    job.movement_checks.push_back({c.at(0), c.at(1), c.at(2), c.at(3), errors_from(c.at(4))});
  }
}

namespace fs = std::filesystem;

using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

Statement prepare(sqlite3* database, const char* sql) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
  return {statement, sqlite3_finalize};
}

bool run(sqlite3* database, const char* sql) {
  return sqlite3_exec(database, sql, nullptr, nullptr, nullptr) == SQLITE_OK;
}

std::string text(sqlite3_stmt* statement, int column) {
  const auto* const bytes = sqlite3_column_blob(statement, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
  return bytes ? std::string(static_cast<const char*>(bytes), size) : std::string();
}

void set_text(sqlite3_stmt* statement, int parameter, const std::string& value) {
  sqlite3_bind_text(statement, parameter, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
}

/// Differs when a file with the job's state has been written since, or the record has changed.
std::string stamp(const fs::path& folder, const std::string& record) {
  std::string stamp;
  for (const char* name :
       {"scan.json", "job.json", "failure.json", "attempt.json", "model/report.json", "choices/choices.json"}) {
    struct stat file {};
    if (::stat((folder / name).c_str(), &file) != 0) file = {};
    stamp += fmt::format("{}.{}.{}.{};", file.st_ino, file.st_size, file.st_mtim.tv_sec, file.st_mtim.tv_nsec);
  }
  return stamp + sha256(record);
}

}  // namespace

std::string to_record(const JobInfo& job) {
  const nlohmann::json j = {{"layout", kLayout},
                            {"id", job.id},
                            {"folder", job.folder},
                            {"state", to_string(job.state)},
                            {"complete", job.complete},
                            {"quarantined", job.quarantined},
                            {"passed", job.passed ? nlohmann::json(*job.passed) : nlohmann::json()},
                            {"error", to_json(job.error)},
                            {"model", job.model},
                            {"report", job.report},
                            {"remarks", job.remarks},
                            {"choices", choices_of(job)},
                            {"picked", job.picked},
                            {"config_sha256", job.config_sha256},
                            {"stored", views_of(job)},
                            {"movement_checks", movement_checks_of(job)}};
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool from_record(const std::string& text, JobInfo& job) {
  try {
    const auto j = nlohmann::json::parse(text);
    if (j.at("layout") != kLayout) return false;
    read(j, job);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

JobIndex::JobIndex(fs::path file) : file_(std::move(file)) {
  if (open()) return;
  close();
  std::error_code ignored;
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) fs::remove(file_.string() + suffix, ignored);
  if (!open()) close();
}

JobIndex::~JobIndex() { close(); }

void JobIndex::close() {
  sqlite3_close(database_);
  database_ = nullptr;
}

bool JobIndex::open() {
  if (sqlite3_open_v2(file_.c_str(), &database_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr) != SQLITE_OK) {
    return false;
  }
  sqlite3_busy_timeout(database_, 200);  // milliseconds: another process may read it
  const auto check = prepare(database_, "PRAGMA quick_check(1)");
  if (!check || sqlite3_step(check.get()) != SQLITE_ROW || text(check.get(), 0) != "ok") return false;
  return run(database_,
             "CREATE TABLE IF NOT EXISTS jobs (id TEXT PRIMARY KEY, state TEXT, part TEXT, recipe TEXT, stamp TEXT, "
             "info TEXT)") &&
         prepare(database_, "SELECT id, state, part, recipe, stamp, info FROM jobs") != nullptr;
}

std::optional<JobInfo> JobIndex::find(const fs::path& job_folder) const {
  if (!database_) return std::nullopt;
  const auto select = prepare(database_, "SELECT stamp, info FROM jobs WHERE id = ?");
  if (!select) return std::nullopt;
  set_text(select.get(), 1, job_folder.filename());
  if (sqlite3_step(select.get()) != SQLITE_ROW) return std::nullopt;
  const auto record = text(select.get(), 1);
  if (text(select.get(), 0) != stamp(job_folder, record)) return std::nullopt;
  JobInfo job;
  if (!from_record(record, job) || job.folder != job_folder) return std::nullopt;
  const auto order = read_job_file(job_folder);
  if (!order || order->recipe.is_calibration()) return std::nullopt;  // its report is not in the record
  job.recipe = order->recipe;
  job.part = order->part;
  job.place = order->place;
  job.exported = order->exported;
  return job;
}

void JobIndex::replace(const JobTable& jobs) {
  if (!database_ || !run(database_, "BEGIN; DELETE FROM jobs")) return;
  const auto insert = prepare(database_, "INSERT INTO jobs VALUES (?, ?, ?, ?, ?, ?)");
  bool whole = insert != nullptr;
  for (const auto& [id, job] : jobs) {
    if (!whole) break;
    if (!is_final(job->state) || job->quarantined) continue;  // these are read from their folders
    set_text(insert.get(), 1, id);
    set_text(insert.get(), 2, std::string(to_string(job->state)));
    set_text(insert.get(), 3, job->part);
    set_text(insert.get(), 4, job->recipe.name);
    const auto record = to_record(*job);
    set_text(insert.get(), 5, stamp(job->folder, record));
    set_text(insert.get(), 6, record);
    whole = sqlite3_step(insert.get()) == SQLITE_DONE;
    sqlite3_reset(insert.get());
  }
  run(database_, whole ? "COMMIT" : "ROLLBACK");
}

}  // namespace scanrig
