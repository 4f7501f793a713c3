#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "daemon/station/job_info.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/storage/images.h"

namespace scanrig {

/// A scan on its way to a model, as the daemon uses it: views come while the table turns.
/// Threads: one user at a time.
class Reconstructor {
 public:
  virtual ~Reconstructor() = default;
  virtual Result<void> add_view(std::size_t pose, const RawView& raw, const ViewRecord& record,
                                const Context& context) = 0;
  /// Whether the views of the pose are enough. Only of a calibration: fails with `below_limits`, then it is taken
  /// again.
  virtual Result<void> check_pose(std::size_t) { return {}; }
  /// Its views are taken again.
  virtual void drop_pose(std::size_t) {}
  virtual Result<void> finish_pose(std::size_t pose, const Context& context) = 0;
  /// GLB files to be shown while the scan grows: the view that was added last, the pose that was finished last. Empty:
  /// this one shows nothing.
  virtual std::string live_view(std::size_t) { return {}; }
  virtual std::string live_pose(std::size_t) { return {}; }
  /// How the object of that pose could lie in the next one, best first, each with a PNG of it; after live_pose().
  struct Suggestion {
    SuggestedRest rest;
    std::string png;
  };
  virtual std::vector<Suggestion> suggestions(std::size_t) { return {}; }
  /// What finish() would begin with, once all poses are finished.
  virtual Result<void> prepare(const Context&) { return {}; }
  /// Makes the model and writes its files and report.json together: after a failure there is no `folder`.
  virtual Result<void> finish(const std::filesystem::path& folder, const Context& context) = 0;
};

/// Changes for a reprocessing; empty members are as configured.
struct ReconstructionChanges {
  std::optional<double> voxel_mm{};
  std::string fusion{};
};

struct ReconstructionTask {
  const Calibration& calibration;
  std::filesystem::path folder;  ///< of the job
  int views = 0;                 ///< of all poses, once they exist
  bool fixture = false;          ///< of the recipe: parts stand on putty, pins or a magnet
  ReconstructionChanges changes{};
  /// True once the daemon ends: work outside of its process then continues although a stop is requested.
  std::function<bool()> is_ending = [] { return false; };
};

/// Fails with `out_of_range` when the work would need more memory than allowed.
using ReconstructorFactory = std::function<Result<std::unique_ptr<Reconstructor>>(const ReconstructionTask&)>;

}  // namespace scanrig
