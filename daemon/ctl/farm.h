#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::ctl {

/// Models of many scan folders by one Slurm array.
struct FarmOptions {
  std::vector<std::filesystem::path> scans;
  std::vector<std::string> with;  ///< further words of `scanrig reconstruct`
  std::filesystem::path out;      ///< models are OUT/NAME; empty: each scan's own model is replaced
  std::string partition;          ///< empty: the cluster's default
  std::vector<std::string> sbatch;
  std::filesystem::path program = "/usr/bin/scanrig";  ///< on the nodes
  std::filesystem::path commands;                      ///< folder of sbatch; empty: PATH
  int cores = 2;                                       ///< of a task
  double memory_gib = 6;                               ///< of a task
  int resubmits = 2;                                   ///< of a scan that the cluster lost
};

struct FarmEnd {
  std::filesystem::path scan;
  std::optional<Error> error;  ///< none: its model is there
};

struct FarmCount {
  int done = 0, failed = 0, skipped = 0;
  std::optional<Error> first{};  ///< failure
};

/// Makes the models that are missing, or that were made with other options or by another version. `report` is called
/// as each scan ends. What a stopped or dead run left at the cluster is taken up. Fails with `invalid_input`,
/// `not_found`, `io` (before anything is submitted), `refused`, `timeout` (no controller), `stopped`.
Result<FarmCount> run_farm(const FarmOptions& options, const std::stop_token& stop,
                           const std::function<void(const FarmEnd&)>& report);

}  // namespace scanrig::ctl
