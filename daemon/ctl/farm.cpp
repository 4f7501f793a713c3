#include "daemon/ctl/farm.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "core/files.h"
#include "core/secrets.h"
#include "core/version.h"
#include "daemon/jobs/node_run.h"
#include "daemon/jobs/progress_lines.h"
#include "daemon/jobs/slurm_client.h"
#include "daemon/jobs/stoppable_wait.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;
using FarmClock = std::chrono::steady_clock;

constexpr const char* kRecord = "farm.json";
constexpr auto kFilesEvery = std::chrono::milliseconds(500);
constexpr auto kTasksEvery = std::chrono::seconds(2);
constexpr auto kFilesLimit = std::chrono::seconds(20);  ///< until the files of a task that has ended are seen here
constexpr auto kGather = std::chrono::seconds(5);       ///< scans to be submitted again
constexpr auto kAwayLimit = std::chrono::hours(1);      ///< of the controller

/// One scan on its way.
struct FarmItem {
  fs::path scan, model;
  fs::path work;    ///< folder of its runs
  std::string run;  ///< empty: not submitted
  int task = 0;
  int lost = 0;
  std::optional<FarmClock::time_point> gone{};  ///< since when the cluster does not have its task

  [[nodiscard]] fs::path folder() const { return work / run; }
};

nlohmann::json read_record(const fs::path& file) {
  const auto text = read_file(file);
  const auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  return json.is_object() ? json : nlohmann::json::object();
}

std::string array_name(const std::string& run) { return "scanrig-farm-" + run; }

class Farm {
 public:
  Farm(const FarmOptions& options, const std::stop_token& stop, const std::function<void(const FarmEnd&)>& report)
      : options_(options),
        stop_(stop),
        report_(report),
        key_(fmt::format("{} {}", kVersion, fmt::join(options.with, " "))),
        client_(options.commands) {}

  Result<FarmCount> run() {
    if (auto listed = list(); !listed) return pass_on(listed);
    if (auto taken = take_up(); !taken) return pass_on(taken);
    auto next_look = FarmClock::now();
    answered_ = gathered_ = FarmClock::now();
    while (!waiting_.empty() || !items_.empty()) {
      if (FarmClock::now() >= next_look) {
        if (auto read = read_tasks(); !read) return pass_on(read);
        next_look = FarmClock::now() + kTasksEvery;
      }
      std::erase_if(items_, [this](FarmItem& item) { return ends(item); });
      if (!waiting_.empty() && (items_.empty() || FarmClock::now() >= gathered_ + kGather)) {
        if (auto submitted = submit(); !submitted) return pass_on(submitted);
      }
      if (!items_.empty() && !wait_or_stop(stop_, kFilesEvery)) {
        return fail(ErrorCode::stopped, "stopped; {} scans continue at the cluster, the same command takes them up",
                    items_.size() + waiting_.size());
      }
    }
    return count_;
  }

 private:
  /// The scans without a model of these options.
  Result<void> list() {
    std::set<fs::path> models;
    for (const auto& given : options_.scans) {
      std::error_code error;
      const auto scan = fs::canonical(given, error);
      if (error || !fs::exists(scan / "scan.json", error)) {
        return fail(ErrorCode::not_found, "{}: no scan folder, there is no scan.json in it", given.string());
      }
      if (scan.string().find_first_of("\t\n") != std::string::npos) {
        return fail(ErrorCode::invalid_input, "{}: a tab or a line end in its name; rename it", given.string());
      }
      const auto out = options_.out.empty() ? scan : fs::absolute(options_.out) / scan.filename();
      FarmItem item{.scan = scan,
                    .model = options_.out.empty() ? scan / "model" : out,
                    .work = options_.out.empty() ? scan / "slurm" : fs::path(out.string() + ".slurm"),
                    .run = ""};
      if (!models.insert(item.model).second) {
        return fail(ErrorCode::invalid_input, "{}: two scans would have the model {}", given.string(),
                    item.model.string());
      }
      if (read_record(item.model / kRecord).value("options", "") == key_) {
        ++count_.skipped;
      } else {
        items_.push_back(std::move(item));
      }
    }
    return {};
  }

  /// What an earlier run left at the cluster; the rest waits to be submitted.
  Result<void> take_up() {
    std::map<std::string, std::map<int, SlurmJob::State>> active;
    for (auto& item : items_) {
      const auto record = read_record(item.work / kRecord);
      const auto run = record.value("run", "");
      if (run.empty() || record.value("options", "") != key_) continue;
      if (!active.contains(run)) {
        auto tasks = client_.tasks(array_name(run), stop_);
        if (!tasks) return pass_on(tasks);
        active[run] = *std::move(tasks);
      }
      item.task = record.value("task", 0);
      if (active[run].contains(item.task) || run_end(item.work / run)) item.run = run;
    }
    std::erase_if(items_, [this](FarmItem& item) {
      if (item.run.empty()) waiting_.push_back(item);
      return item.run.empty();
    });
    return {};
  }

  /// Submits what waits, as one array. With more scans than an array may have tasks, a task makes several models.
  Result<void> submit() {
    const auto max_tasks = client_.max_array(stop_);
    if (!max_tasks) return pass_on(max_tasks);
    auto run = random_hexadecimal(8);
    if (!run) return pass_on(run);
    const int scans = static_cast<int>(waiting_.size()), limit = std::max(1, *max_tasks - 1);
    const int each = (scans + limit - 1) / limit, tasks = (scans + each - 1) / each;
    int index = 0;
    for (auto& item : waiting_) {
      item.run = *run;
      item.task = index++ / each;
      item.gone.reset();
      std::error_code error;
      fs::create_directories(item.folder(), error);
      std::ofstream record(item.work / kRecord);
      record << nlohmann::json{{"run", *run}, {"task", item.task}, {"options", key_}}.dump() << "\n";
      record.close();
      if (error || !record.good()) return fail(ErrorCode::io, "{}: cannot be written", item.work.string());
    }
    const auto id = submit_script(*run, script(each), tasks);
    if (!id) return pass_on(id);
    ids_[*run] = *id;
    items_.insert(items_.end(), waiting_.begin(), waiting_.end());
    waiting_.clear();
    return {};
  }

  /// The scans are lines within the script: the nodes need no further file.
  [[nodiscard]] std::string script(int each) const {
    std::vector<std::string> words{"--threads", fmt::format("{}", options_.cores), "--memory-gib",
                                   fmt::format("{}", options_.memory_gib)};
    words.insert(words.end(), options_.with.begin(), options_.with.end());
    auto text = fmt::format("#!/bin/sh\n{}first=$((SLURM_ARRAY_TASK_ID * {} + 1))\n",
                            run_function(options_.program, words), each) +
                fmt::format("sed -n \"${{first}},$((first + {}))p\" << 'SCANS' |\n", each - 1);
    for (const auto& item : waiting_) text += fmt::format("{}\t{}\n", item.scan.string(), item.folder().string());
    return text + "SCANS\nwhile IFS='\t' read -r scan folder; do run \"$scan\" \"$folder\"; done\n";
  }

  Result<std::string> submit_script(const std::string& run, const std::string& text, int tasks) const {
    const auto file = fs::temp_directory_path() / (array_name(run) + ".sh");
    if (auto written = write_file_atomically(file, text); !written) return pass_on(written);
    std::vector<std::string> options{"--job-name=" + array_name(run),
                                     "--chdir=/",
                                     "--output=/dev/null",
                                     fmt::format("--array=0-{}", tasks - 1),
                                     fmt::format("--cpus-per-task={}", options_.cores),
                                     fmt::format("--mem={:.0f}M", 1024 * options_.memory_gib)};
    if (!options_.partition.empty()) options.push_back("--partition=" + options_.partition);
    options.insert(options.end(), options_.sbatch.begin(), options_.sbatch.end());
    auto id = client_.submit(options, file, stop_);
    std::error_code ignored;
    fs::remove(file, ignored);
    return id;
  }

  /// Reads which tasks the cluster has. It may be away for some time.
  Result<void> read_tasks() {
    std::map<std::string, std::map<int, SlurmJob::State>> active;
    for (const auto& item : items_) {
      if (active.contains(item.run)) continue;
      auto tasks = client_.tasks(array_name(item.run), stop_);
      if (tasks) {
        active[item.run] = *std::move(tasks);
        continue;
      }
      const bool is_late = FarmClock::now() >= answered_ + kAwayLimit;
      return tasks.error().code == ErrorCode::timeout && !is_late ? Result<void>() : pass_on(tasks);
    }
    answered_ = FarmClock::now();
    for (auto& item : items_) {
      if (active[item.run].contains(item.task)) {
        item.gone.reset();
      } else if (!item.gone) {
        item.gone = FarmClock::now();
      }
    }
    return {};
  }

  /// True when the scan has ended or waits to be submitted again.
  bool ends(FarmItem& item) {
    const auto code = run_end(item.folder());
    if (code && !was_ended_from_outside(*code)) {
      take(item, *code);
      return true;
    }
    if (!item.gone || (!code && FarmClock::now() < *item.gone + kFilesLimit)) return false;
    const auto job = ids_.contains(item.run) ? client_.look(fmt::format("{}_{}", ids_[item.run], item.task), stop_)
                                             : Result<SlurmJob>(SlurmJob{});
    if (!job) return false;  // the controller is away: later
    std::error_code ignored;
    if (job->exit_code == kNoFolder) {
      tell(item, Error{ErrorCode::not_found, fmt::format("{} does not see {}; share this folder with the nodes",
                                                         job->nodes, item.folder().string())});
    } else if (code && job->word == "FAILED") {
      take(item, *code);
      return true;
    } else if (job->state == SlurmJob::State::ended && job->word != "COMPLETED" && job->word != "FAILED") {
      tell(item, Error{job->word == "TIMEOUT" ? ErrorCode::timeout : ErrorCode::internal,
                       fmt::format("Slurm ended its task {}_{} on {} as {}", ids_[item.run], item.task, job->nodes,
                                   job->word)});
    } else if (++item.lost > options_.resubmits) {
      tell(item, Error{ErrorCode::timeout, fmt::format("the cluster lost it {} times; check its nodes", item.lost)});
    } else {
      fs::remove_all(item.folder(), ignored);
      if (waiting_.empty()) gathered_ = FarmClock::now();
      waiting_.push_back(item);
      return true;
    }
    fs::remove_all(item.work, ignored);
    return true;
  }

  /// The run's model becomes the scan's, or its failure is reported.
  void take(const FarmItem& item, int code) {
    const Context quiet;
    ProgressLines progress(quiet);
    RunLines(item.folder()).read([&](std::string_view line) { progress(line); });
    Result<void> taken;
    if (code != 0) {
      taken = tl::unexpected(run_error(item.folder(), code, progress.failure));
    } else {
      const auto record = nlohmann::json{{"options", key_}}.dump() + "\n";
      taken = write_file_atomically(run_model(item.folder()) / kRecord, record);
      if (taken) taken = replace_folder(run_model(item.folder()), item.model);
    }
    std::error_code ignored;
    fs::remove_all(item.work, ignored);
    tell(item, taken ? std::nullopt : std::optional(taken.error()));
  }

  void tell(const FarmItem& item, std::optional<Error> error) {
    ++(error ? count_.failed : count_.done);
    if (error && !count_.first) count_.first = error;
    report_({item.scan, std::move(error)});
  }

  const FarmOptions& options_;
  const std::stop_token& stop_;
  const std::function<void(const FarmEnd&)>& report_;
  std::string key_;  ///< version and options that a model is made with
  SlurmClient client_;
  std::vector<FarmItem> items_, waiting_;
  std::map<std::string, std::string> ids_;  ///< of the arrays that this run submitted
  FarmClock::time_point answered_{}, gathered_{};
  FarmCount count_;
};

}  // namespace

Result<FarmCount> run_farm(const FarmOptions& options, const std::stop_token& stop,
                           const std::function<void(const FarmEnd&)>& report) {
  if (options.scans.empty()) return fail(ErrorCode::invalid_input, "no scan folders; name some");
  return Farm(options, stop, report).run();
}

}  // namespace scanrig::ctl
