#pragma once

#include <filesystem>

#include "core/context.h"
#include "core/result.h"

namespace scanrig {

/// Packs a job's folder as it is into the file `target` (.tar.gz), for whoever must help: images, manifest,
/// calibration, report, failure. The file appears under its name when it is whole.
/// Fails with `exists`, `invalid_input` (not an absolute path), `io`, `stopped`.
Result<void> bundle(const std::filesystem::path& job_folder, const std::filesystem::path& target,
                    const Context& context);

}  // namespace scanrig
