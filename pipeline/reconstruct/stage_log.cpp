#include "pipeline/reconstruct/stage_log.h"

#include <sys/resource.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace scanrig {
namespace {

double peak_memory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace

StageLog::Timer::Timer(StageLog& log, std::string stage)
    : log_(log), stage_(std::move(stage)), start_(std::chrono::steady_clock::now()) {}

StageLog::Timer::~Timer() {
  log_.add(stage_, std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
}

void StageLog::add(const std::string& stage, double seconds) {
  auto entry = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.stage == stage; });
  if (entry == entries_.end()) {
    entries_.push_back({.stage = stage});
    entry = entries_.end() - 1;
  }
  entry->seconds += seconds;
  entry->peak_memory_mib = peak_memory_mib();
  ++entry->runs;
}

nlohmann::json StageLog::to_json() const {
  nlohmann::json stages = nlohmann::json::array();
  for (const Entry& entry : entries_) {
    stages.push_back({{"stage", entry.stage},
                      {"seconds", entry.seconds},
                      {"runs", entry.runs},
                      {"process_peak_memory_mib", entry.peak_memory_mib}});
  }
  return stages;
}

}  // namespace scanrig
