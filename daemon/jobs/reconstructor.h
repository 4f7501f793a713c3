#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/scan/images.h"
#include "pipeline/scan/manifest.h"

namespace scanrig {

/// A scan on its way to a model, as the daemon sees it: views come while the table turns.
/// Threads: one user at a time.
class Reconstructor {
 public:
  virtual ~Reconstructor() = default;
  virtual Result<void> add_view(std::size_t pose, const ViewImages& images, const Context& context) = 0;
  virtual Result<void> finish_pose(std::size_t pose, const Context& context) = 0;
  /// Makes the model and writes its files and report.json as a whole: after a failure there is no `folder`.
  virtual Result<void> finish(const std::filesystem::path& folder, const Context& context) = 0;
};

using ReconstructorFactory = std::function<std::unique_ptr<Reconstructor>(const Calibration&, const Manifest&)>;

}  // namespace scanrig
