#include "daemon/jobs/job_index.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <memory>
#include <system_error>

#include "core/hash.h"
#include "daemon/jobs/job_files.h"
#include "daemon/jobs/job_record.h"

namespace scanrig {
namespace {

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
  for (const char* name : {"scan.json", "job.json", "failure.json", "attempt.json", "model/report.json"}) {
    struct stat file {};
    if (::stat((folder / name).c_str(), &file) != 0) file = {};
    stamp += fmt::format("{}.{}.{}.{};", file.st_ino, file.st_size, file.st_mtim.tv_sec, file.st_mtim.tv_nsec);
  }
  return stamp + sha256(record);
}

}  // namespace

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
  if (!order) return std::nullopt;
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
