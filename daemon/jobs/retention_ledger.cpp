#include "daemon/jobs/retention_ledger.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/files.h"

namespace scanrig {
namespace {

using nlohmann::json;
using std::chrono::seconds;

constexpr const char* kFormat = "scanrig-retention";

/// Some 270 years, in seconds: sums stay far from overflow, in nanoseconds too. Throws for all others.
std::int64_t bounded(const json& number) {
  constexpr std::int64_t kMax = std::int64_t{1} << 33;
  if (!number.is_number_integer()) throw std::out_of_range("not an integer");
  const auto value = number.get<std::int64_t>();
  if (value < 0 || value > kMax) throw std::out_of_range("too large");
  return value;
}

}  // namespace

RetentionLedger RetentionLedger::read(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return {};
  try {
    const auto j = json::parse(*text);
    if (j.at("format") != kFormat || j.at("version") != 1) return {};
    RetentionLedger ledger;
    ledger.count_ = seconds(bounded(j.at("count_s")));
    ledger.last_number_ = static_cast<std::uint64_t>(bounded(j.at("last_number")));
    ledger.last_ = TimeReading{.wall = std::chrono::system_clock::time_point(seconds(bounded(j.at("wall_s")))),
                               .is_synchronized = j.at("synchronized").get<bool>(),
                               .running = seconds(bounded(j.at("running_s")))};
    for (const auto& [id, job] : j.at("jobs").items()) {
      Entry entry{job.at("mark").get<std::string>(), seconds(bounded(job.at("since_s"))),
                  static_cast<std::uint64_t>(bounded(job.at("number")))};
      if (entry.since > ledger.count_ || entry.number > ledger.last_number_) return {};
      ledger.jobs_.emplace(id, std::move(entry));
    }
    return ledger;
  } catch (const std::exception&) {
    return {};
  }
}

Result<void> RetentionLedger::write(const std::filesystem::path& file) const {
  json jobs = json::object();
  for (const auto& [id, entry] : jobs_) {
    jobs[id] = {{"mark", entry.mark}, {"since_s", entry.since.count()}, {"number", entry.number}};
  }
  const auto last = last_.value_or(TimeReading{});
  const auto wall = std::chrono::floor<seconds>(last.wall).time_since_epoch().count();
  const json j = {{"format", kFormat},
                  {"version", 1},
                  {"count_s", count_.count()},
                  {"last_number", last_number_},
                  {"wall_s", std::max<std::int64_t>(wall, 0)},
                  {"synchronized", last.is_synchronized},
                  {"running_s", last.running.count()},
                  {"jobs", std::move(jobs)}};
  return write_file_atomically(file, j.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

/// Since an earlier start of the machine more time has passed than its present run: the difference is never too large.
void RetentionLedger::advance(const TimeReading& now) {
  if (last_) {
    auto passed = std::max(now.running - last_->running, seconds(0));
    if (!same_process_ && last_->is_synchronized && now.is_synchronized) {
      const auto by_wall = std::chrono::floor<seconds>(now.wall - last_->wall);
      if (by_wall > passed && by_wall - passed <= kMaxPause) passed = by_wall;
    }
    count_ += passed;
  }
  last_ = now;
  same_process_ = true;
}

const RetentionLedger::Entry& RetentionLedger::note(const std::string& id, const std::string& mark) {
  auto& entry = jobs_[id];
  if (entry.number == 0 || entry.mark != mark) entry = {mark, count_, ++last_number_};
  return entry;
}

void RetentionLedger::keep_only(const std::set<std::string>& ids) {
  std::erase_if(jobs_, [&](const auto& job) { return !ids.contains(job.first); });
}

}  // namespace scanrig
