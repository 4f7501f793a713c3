#include "daemon/jobs/retention.h"

#include <sys/timex.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "core/files.h"
#include "daemon/jobs/child_process.h"

namespace scanrig {
namespace {

constexpr const char* kTimedatectl = "/usr/bin/timedatectl";
constexpr auto kDeletingLimit = std::chrono::seconds(5);

/// The kernel's estimate of the error starts at 16 s, and returns there when the clock is set by hand. It is kept
/// smaller by timesyncd, chrony and ntpd alike [ntp_synced() of systemd-timedated]. STA_UNSYNC is no
/// criterion: chrony sets it to keep the kernel away from the clock chip. Nothing where the kernel refuses.
std::optional<bool> kernel_synchronized() {
  constexpr long kUnsynchronizedUs = 16'000'000;
  timex state{};  // no modes: reads only
  if (::adjtimex(&state) < 0) return std::nullopt;
  return state.maxerror < kUnsynchronizedUs;
}

/// The service's sandbox has no adjtimex (ProtectClock=yes); systemd-timedated, outside of it, reads the same.
bool timedated_synchronized(const std::stop_token& stop) {
  bool synchronized = false;
  const auto ended = run_child({.words = {kTimedatectl, "show", "--property=NTPSynchronized", "--value"},
                                .limit = kDeletingLimit,
                                .on_line = [&](std::string_view line) { synchronized = line == "yes"; }},
                               stop);
  return ended && ended->code == 0 && synchronized;
}

class KernelTime final : public SystemTime {
 public:
  [[nodiscard]] TimeReading read(const std::stop_token& stop) const override {
    const auto known = kernel_synchronized();
    const bool synchronized = known ? *known : timedated_synchronized(stop);
    return {.wall = std::chrono::system_clock::now(),
            .is_synchronized = synchronized,
            .running =
                std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now().time_since_epoch())};
  }
};

using std::chrono::seconds;

constexpr const char* kFormat = "scanrig-retention";

/// Some 270 years, in seconds: sums stay far from overflow, in nanoseconds too. Throws for all others.
std::int64_t bounded(const nlohmann::json& number) {
  constexpr std::int64_t kMax = std::int64_t{1} << 33;
  if (!number.is_number_integer()) throw std::out_of_range("not an integer");
  const auto value = number.get<std::int64_t>();
  if (value < 0 || value > kMax) throw std::out_of_range("too large");
  return value;
}

}  // namespace

std::shared_ptr<const SystemTime> system_time() { return std::make_shared<KernelTime>(); }

RetentionLedger RetentionLedger::read(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return {};
  try {
    const auto j = nlohmann::json::parse(*text);
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
  nlohmann::json jobs = nlohmann::json::object();
  for (const auto& [id, entry] : jobs_) {
    jobs[id] = {{"mark", entry.mark}, {"since_s", entry.since.count()}, {"number", entry.number}};
  }
  const auto last = last_.value_or(TimeReading{});
  const auto wall = std::chrono::floor<seconds>(last.wall).time_since_epoch().count();
  const nlohmann::json j = {{"format", kFormat},
                            {"version", 1},
                            {"count_s", count_.count()},
                            {"last_number", last_number_},
                            {"wall_s", std::max<std::int64_t>(wall, 0)},
                            {"synchronized", last.is_synchronized},
                            {"running_s", last.running.count()},
                            {"jobs", std::move(jobs)}};
  return write_file_atomically(file, j.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
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

std::vector<std::string> jobs_to_remove(std::vector<KeptJob> jobs, const RetentionOptions& options) {
  const auto is_too_old = [&](const KeptJob& job) { return options.keep_for && job.age > *options.keep_for; };
  std::ranges::sort(jobs, {}, [&](const KeptJob& job) { return std::tuple(!is_too_old(job), job.number, job.id); });
  std::uintmax_t total = 0;
  for (const auto& job : jobs) total += job.bytes;
  std::vector<std::string> gone;
  for (const auto& job : jobs) {
    const bool is_too_much = options.keep_bytes && total > *options.keep_bytes;
    if (!job.is_removable || (!is_too_old(job) && !is_too_much)) continue;
    gone.push_back(job.id);
    total -= job.bytes;
  }
  return gone;
}

}  // namespace scanrig
