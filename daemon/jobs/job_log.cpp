#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/timestamp.h"
#include "daemon/jobs/bundle.h"
#include "daemon/jobs/job_files.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxMessage = 4096;

std::string line_of(const JournalEntry& entry, std::chrono::system_clock::time_point when) {
  ordered_json json{{"time", iso_time(when)},
                    {"priority", static_cast<int>(entry.priority)},
                    {"message", without_secrets(entry.message).substr(0, kMaxMessage)}};
  if (entry.pose) json["pose"] = *entry.pose;
  if (entry.view) json["view"] = *entry.view;
  if (!entry.device.empty()) json["device"] = entry.device;
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

std::filesystem::path job_log_file(const std::filesystem::path& job_folder) { return job_folder / "log.jsonl"; }

Result<void> append_job_log(const std::filesystem::path& job_folder, const JournalEntry& entry,
                            std::chrono::system_clock::time_point when) {
  const auto file = job_log_file(job_folder);
  const int fd = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0640);
  if (fd < 0) {
    const auto code = errno == ENOENT ? ErrorCode::not_found : ErrorCode::io;
    return fail(code, "cannot open {}: {}", file.string(), std::strerror(errno));
  }
  struct stat info {};
  auto text = line_of(entry, when);
  const bool known = ::fstat(fd, &info) == 0;
  const auto size = static_cast<std::uintmax_t>(info.st_size);
  if (known && size < kMaxJobLogBytes && size + text.size() >= kMaxJobLogBytes) {
    text +=
        line_of({.priority = Priority::warning, .message = "This log is full. Later entries: see the journal."}, when);
  }
  const bool is_written =
      known && (size >= kMaxJobLogBytes || ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  const int error = errno;
  ::close(fd);
  if (is_written) return {};
  return fail(ErrorCode::io, "cannot write {}: {}", file.string(), std::strerror(error));
}

}  // namespace scanrig
