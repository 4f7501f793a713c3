#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/context.h"
#include "core/result.h"

namespace scanrig {

/// `text` with API tokens and the addresses of URLs, which may carry credentials, replaced by "(removed)".
std::string without_secrets(std::string_view text);

/// Content of a bundle beside the job's folder.
struct BundleOptions {
  std::map<std::string, std::string> rig_texts{};  ///< by file name: rig.toml, the drive profile
  std::filesystem::path calibration_file{};        ///< the rig's; empty or missing: none
  std::filesystem::path crash_folder{};            ///< its newest *.txt; empty or missing: none
  std::uintmax_t reserve_bytes = 0;                ///< bytes to leave free on the disk of the target
};

/// Packs for support into the file `target` (.tar.gz): the job's folder as it is, and in it rig/ and crash/, without
/// secrets. The file appears under its name when it is complete.
/// Fails with `exists`, `invalid_input` (not an absolute path), `io` (of the disk; also where it does not fit),
/// `stopped`.
Result<void> bundle(const std::filesystem::path& job_folder, const std::filesystem::path& target,
                    const BundleOptions& options, const Context& context);

}  // namespace scanrig
