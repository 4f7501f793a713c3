#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// A job as Slurm's controller has it.
struct SlurmJob {
  enum class State {
    pending,
    running,  ///< or its node still cleans up
    ended,    ///< by itself, a limit or a person
    lost,     ///< ended by its node or by the cluster, or forgotten by the controller: may be submitted again
  };
  State state = State::lost;
  std::string word;   ///< Slurm's own name of the state, such as "NODE_FAIL"
  std::string nodes;  ///< where it ran; empty: nowhere
  int exit_code = 0;  ///< of its script
};

/// Slurm through its commands sbatch, scontrol, squeue and scancel, each with a deadline. No library of Slurm is
/// linked, and no accounting is needed. Threads: any. Every function fails with `timeout` (the controller was not
/// reached, or the command did not end in time), `refused` (the controller refuses), `not_found` (no such command),
/// `stopped`, `io`.
class SlurmClient {
 public:
  /// `commands`: the folder of the commands; empty: they are looked up in PATH. `limit`: for one command.
  explicit SlurmClient(std::filesystem::path commands = {}, std::chrono::seconds limit = std::chrono::seconds(60))
      : commands_(std::move(commands)), limit_(limit) {}

  /// Submits `script` and returns its job's id. After `timeout` or `stopped` the controller may have accepted it.
  Result<std::string> submit(const std::vector<std::string>& options, const std::filesystem::path& script,
                             const std::stop_token& stop) const;
  /// `id`: "12", or "12_3" for a task of an array.
  Result<SlurmJob> look(const std::string& id, const std::stop_token& stop) const;
  /// The id of the pending or running job of this name, if there is one.
  Result<std::optional<std::string>> find(const std::string& name, const std::stop_token& stop) const;
  /// States of the pending and running tasks of the array of this name.
  Result<std::map<int, SlurmJob::State>> tasks(const std::string& name, const std::stop_token& stop) const;
  /// The number of tasks that an array may have.
  Result<int> max_array(const std::stop_token& stop) const;
  /// Cancels the jobs of this name, pending or running. No such job is no error.
  Result<void> cancel(const std::string& name) const;

 private:
  Result<std::vector<std::string>> run(const std::string& command, std::vector<std::string> words,
                                       const std::stop_token& stop) const;

  std::filesystem::path commands_;
  std::chrono::seconds limit_;
};

}  // namespace scanrig
