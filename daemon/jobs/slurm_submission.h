#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/result.h"
#include "daemon/jobs/executors.h"

namespace scanrig {

/// A job of the cluster for one scan: slurm.json in the scan's folder, written durably before the submission and again
/// when the id is known.
struct SlurmSubmission {
  std::string run;  ///< name of the run's folder, new for each submission
  std::string id;   ///< empty: not known to be submitted
  int lost = 0;     ///< earlier jobs of this scan that the cluster lost
  ReconstructionChanges changes{};

  /// The job's name: it finds a job that was submitted, but not recorded.
  [[nodiscard]] std::string name(const std::filesystem::path& scan) const;
};

/// Fails with `io`.
Result<void> write_submission(const std::filesystem::path& scan, const SlurmSubmission& submission);
/// Nothing where there is none, or it cannot be read.
std::optional<SlurmSubmission> read_submission(const std::filesystem::path& scan);

/// Folders of a submission, with and without a stage.
class SlurmPlaces {
 public:
  SlurmPlaces(std::filesystem::path scan, std::filesystem::path stage)
      : scan_(std::move(scan)), stage_(std::move(stage)) {}

  [[nodiscard]] std::filesystem::path run(const SlurmSubmission& submission) const;
  [[nodiscard]] std::filesystem::path scan_for_node(const SlurmSubmission& submission) const;
  /// Makes the run's folder and copies the scan to the stage. Fails with `io`.
  [[nodiscard]] Result<void> prepare(const SlurmSubmission& submission) const;
  /// Puts the run's model, whole and synced, in the place of `model`. Fails with `io`.
  [[nodiscard]] Result<void> take_model(const SlurmSubmission& submission, const std::filesystem::path& model) const;
  /// Copies from the stage in how many ways pose 2 fits, where the run has found several. What cannot be copied is
  /// left.
  void fetch_choices(const SlurmSubmission& submission) const;
  /// Removes the run's folder: a job that starts later ends at once.
  void remove_run(const SlurmSubmission& submission) const;
  /// Removes slurm.json, too. Durable.
  void forget(const SlurmSubmission& submission) const;

 private:
  std::filesystem::path scan_, stage_;
};

}  // namespace scanrig
