#include "daemon/service/safety_record.h"

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/files.h"
#include "core/strict_json.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

constexpr const char* kLatchFile = "latch.json";
constexpr const char* kRunFile = "run.json";
constexpr int kVersion = 1;
constexpr double kMaxSeconds = 1e12;

Result<void> write_json(const std::filesystem::path& file, const ordered_json& json) {
  return write_file_atomically(file, json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n");
}

std::chrono::seconds read_clock(clockid_t clock) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return std::chrono::seconds(now.tv_sec);
}

ordered_json to_json(const Moment& moment) {
  return {{"boot_id", moment.boot_id}, {"boot_s", moment.boot.count()}, {"wall_s", moment.wall.count()}};
}

Moment read_moment(JsonObject object) {
  Moment moment;
  moment.boot_id = object.text("boot_id");
  moment.boot = std::chrono::seconds(static_cast<std::int64_t>(object.number("boot_s", 0, kMaxSeconds)));
  moment.wall = std::chrono::seconds(static_cast<std::int64_t>(object.number("wall_s", -kMaxSeconds, kMaxSeconds)));
  object.close();
  return moment;
}

/// Within one run of the machine its own clock decides: the wall clock may have been set meanwhile.
bool is_recent(const Moment& end, const Moment& now) {
  const auto age = end.boot_id == now.boot_id ? now.boot - end.boot : now.wall - end.wall;
  return age >= std::chrono::seconds(0) && age <= SafetyRecord::kWithin;
}

}  // namespace

Moment moment_now() {
  const auto boot_id = read_file("/proc/sys/kernel/random/boot_id");
  return {boot_id ? boot_id->substr(0, boot_id->find('\n')) : "unknown", read_clock(CLOCK_BOOTTIME),
          read_clock(CLOCK_REALTIME)};
}

Result<std::optional<Latch>> SafetyRecord::begin() {
  if (auto made = create_directories_synced(folder_); !made) return pass_on(made);
  auto latch = read_latch();
  auto ends = unexpected_ends();
  if (!ends) {
    if (!latch) latch = Latch{ends.error().message + "."};
    ends = std::vector<Moment>();
  }
  if (ends->size() >= static_cast<std::size_t>(kUnexpectedEnds)) {
    const auto sentence =
        fmt::format("The service ended unexpectedly {} times within {} minutes.", kUnexpectedEnds, kWithin.count());
    if (!latch) latch = Latch{sentence};
    if (latch->cause.find(sentence) == std::string::npos) latch->cause += " " + sentence;
  }
  if (auto stored = store_latch(latch); !stored) return pass_on(stored);
  for (const auto& rest : unfinished_writes(folder_ / kLatchFile)) {
    if (auto removed = remove_file_synced(rest); !removed) return pass_on(removed);
  }
  if (auto noted = write_run(true, *ends); !noted) return pass_on(noted);
  return latch;
}

Result<void> SafetyRecord::end() { return write_run(false, {}); }

Result<void> SafetyRecord::store_latch(const std::optional<Latch>& latch) {
  const auto file = folder_ / kLatchFile;
  if (!latch) return remove_file_synced(file);
  return write_json(
      file, {{"format", "scanrig-latch"}, {"version", kVersion}, {"cause", latch->cause}, {"device", latch->device}});
}

std::optional<Latch> SafetyRecord::read_latch() const {
  const auto file = folder_ / kLatchFile;
  auto json = JsonFile::read(file, "scanrig-latch", kVersion);
  if (!json && json.error().code == ErrorCode::not_found) {
    if (!unfinished_writes(file).empty()) return Latch{"The service ended while it was storing a fault."};
    return std::nullopt;
  }
  if (!json) return Latch{json.error().message + "."};
  Latch latch{json->root().text("cause"), json->root().text("device")};
  if (const auto whole = json->finish(); !whole) return Latch{whole.error().message + "."};
  return latch;
}

Result<std::vector<Moment>> SafetyRecord::unexpected_ends() const {
  auto json = JsonFile::read(folder_ / kRunFile, "scanrig-run", kVersion);
  if (!json && json.error().code == ErrorCode::not_found) return std::vector<Moment>();
  if (!json) return pass_on(json);
  const bool running = json->root().flag("running");
  std::vector<Moment> ends;
  for (const auto& end : json->root().objects("unexpected_ends")) ends.push_back(read_moment(end));
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  const auto now = now_();
  std::erase_if(ends, [&](const Moment& end) { return !is_recent(end, now); });
  if (running) ends.push_back(now);
  if (ends.size() > kUnexpectedEnds) ends.erase(ends.begin(), ends.end() - kUnexpectedEnds);
  return ends;
}

Result<void> SafetyRecord::write_run(bool running, const std::vector<Moment>& ends) {
  ordered_json list = ordered_json::array();
  for (const auto& end : ends) list.push_back(to_json(end));
  return write_json(
      folder_ / kRunFile,
      {{"format", "scanrig-run"}, {"version", kVersion}, {"running", running}, {"unexpected_ends", list}});
}

LatchWriter::LatchWriter(SafetyRecord& record) : record_(record), thread_([this] { run(); }) {}

LatchWriter::~LatchWriter() {
  {
    const std::lock_guard guard(mutex_);
    end_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

Result<void> LatchWriter::store(std::optional<Latch> latch) {
  std::unique_lock lock(mutex_);
  wanted_ = std::move(latch);
  changed_.notify_all();
  if (!changed_.wait_for(lock, kMaxWait, [this] { return !wanted_ && !writing_; })) {
    return fail(ErrorCode::timeout, "the latched fault is not on the disk yet; check the disk of the state folder");
  }
  return done_;
}

void LatchWriter::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return wanted_ || end_; });
    if (!wanted_) return;
    const auto latch = *std::exchange(wanted_, std::nullopt);
    writing_ = true;
    lock.unlock();
    auto done = record_.store_latch(latch);
    lock.lock();
    writing_ = false;
    done_ = std::move(done);
    changed_.notify_all();
  }
}

}  // namespace scanrig
