#pragma once

#include <fmt/format.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

#include "core/files.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig::fakes {

/// Checks repeatedly, for 20 s at most.
inline bool comes_true(const std::function<bool()>& as_wanted) {
  for (const auto by = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       std::chrono::steady_clock::now() < by; std::this_thread::sleep_for(std::chrono::milliseconds(5))) {
    if (as_wanted()) return true;
  }
  return false;
}

/// The four commands of a cluster that runs its jobs at once, each in a process group. Files in its folder change what
/// it does: `away` (no controller), `deaf` (accepts, then the reply does not come), `refuses`, `blind` (nodes that see
/// no folder). `jobs/ID/` has a job's `name` and `state`; `submissions` a line per submission.
class FakeSlurm {
 public:
  explicit FakeSlurm(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::filesystem::create_directories(folder_ / "jobs");
    write("sbatch", R"sh(
echo "$@" >> submissions
if [ -e away ]; then echo 'sbatch: error: Batch job submission failed: Unable to contact slurm controller (connect failure)' >&2; exit 1; fi
if [ -e refuses ]; then echo 'sbatch: error: Batch job submission failed: Invalid partition name specified' >&2; exit 1; fi
id=$(($(ls jobs | wc -l) + 1)); mkdir jobs/$id
tasks=0
for word; do
  case $word in --job-name=*) echo "${word#*=}" > jobs/$id/name;; --array=*) tasks=${word##*-};; esac
  script=$word
done
cp "$script" jobs/$id/script
echo $tasks > jobs/$id/tasks
echo RUNNING > jobs/$id/state
if [ -e blind ]; then echo 66 > jobs/$id/exit; echo FAILED > jobs/$id/state; echo $id; exit; fi
setsid sh -c "
echo \$\$ > jobs/$id/pid
for task in \$(seq 0 $tasks); do SLURM_ARRAY_TASK_ID=\$task sh jobs/$id/script; code=\$?; done > jobs/$id/out 2>&1
echo \$code > jobs/$id/exit
if [ \$code = 0 ]; then echo COMPLETED > jobs/$id/state; else echo FAILED > jobs/$id/state; fi" > /dev/null 2>&1 &
while [ ! -s jobs/$id/pid ]; do sleep 0.01; done
if [ -e deaf ]; then rm deaf; exec sleep 600; fi
echo $id
)sh");
    const std::string away =
        "if [ -e away ]; then echo 'slurm_load_jobs error: Unable to contact slurm controller (connect failure)' >&2; "
        "exit 1; fi\n";
    write("scontrol", away + R"sh(
if [ "$2" = config ]; then echo 'MaxArraySize            = 1001'; exit; fi
id=${3%%_*}
if [ ! -e jobs/$id ]; then echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1; fi
echo "JobId=$id JobName=$(cat jobs/$id/name) JobState=$(cat jobs/$id/state) Reason=None NodeList=n1 ExitCode=$(cat jobs/$id/exit 2> /dev/null || echo 0):0 "
)sh");
    write("squeue", away + R"sh(
array=
for word; do case $word in --name=*) name=${word#*=};; --array) array=1;; esac; done
for job in jobs/*; do
  if [ "$(cat $job/name 2> /dev/null)" = "$name" ] && [ "$(cat $job/state)" = RUNNING ]; then
    if [ $array ]; then for task in $(seq 0 $(cat $job/tasks)); do echo "$task RUNNING"; done; else basename $job; fi
  fi
done
exit 0
)sh");
    write("scancel", away + R"sh(
name=${1#*=}
for job in jobs/*; do
  if [ "$(cat $job/name 2> /dev/null)" = "$name" ] && [ "$(cat $job/state)" = RUNNING ]; then
    if [ -s $job/pid ]; then kill -KILL -$(cat $job/pid); fi
    echo CANCELLED > $job/state
  fi
done
exit 0
)sh");
  }
  ~FakeSlurm() {
    remove("away");
    for (int id = 1; id <= jobs(); ++id) {
      run("scancel --name=" + name(id));
      // One that the test called lost still runs.
      run(fmt::format("[ -e jobs/{0}/exit ] || kill -KILL -$(cat jobs/{0}/pid) 2> /dev/null", id));
    }
  }
  FakeSlurm(const FakeSlurm&) = delete;
  FakeSlurm& operator=(const FakeSlurm&) = delete;

  [[nodiscard]] const std::filesystem::path& commands() const { return folder_; }
  void set(const std::string& file) const { scan_samples::write_text(folder_ / file, ""); }
  void remove(const std::string& file) const { std::filesystem::remove(folder_ / file); }
  [[nodiscard]] int jobs() const {
    int count = 0;
    for ([[maybe_unused]] const auto& job : std::filesystem::directory_iterator(folder_ / "jobs")) ++count;
    return count;
  }
  [[nodiscard]] std::string submissions() const { return read_file(folder_ / "submissions").value_or(""); }
  [[nodiscard]] std::string name(int id) const { return line("name", id); }
  [[nodiscard]] std::string state(int id) const { return line("state", id); }
  /// Whether its processes have begun: before, they end with sbatch.
  [[nodiscard]] bool runs(int id) const { return !line("pid", id).empty(); }
  void set_state(int id, const std::string& state) const { scan_samples::write_text(of(id) / "state", state + "\n"); }
  /// The job's processes end, as with its node.
  void kill(int id) const {
    if (comes_true([&] { return runs(id); })) run("kill -KILL -" + line("pid", id));
  }

 private:
  void write(const std::string& command, const std::string& script) const {
    const auto file = folder_ / command;
    scan_samples::write_text(file, "#!/bin/sh\ncd '" + folder_.string() + "' || exit 1\n" + script);
    ::chmod(file.c_str(), 0755);
  }
  void run(const std::string& words) const {
    const auto command = "cd '" + folder_.string() + "' && PATH=$PWD:$PATH && " + words;
    [[maybe_unused]] const int ignored = std::system(command.c_str());
  }
  [[nodiscard]] std::filesystem::path of(int id) const { return folder_ / "jobs" / std::to_string(id); }
  [[nodiscard]] std::string line(const char* file, int id) const {
    const auto text = read_file(of(id) / file).value_or("");
    return text.substr(0, text.find('\n'));
  }

  std::filesystem::path folder_;
};

}  // namespace scanrig::fakes
