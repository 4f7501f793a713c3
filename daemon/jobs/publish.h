#pragma once

#include <filesystem>
#include <functional>

#include "core/result.h"

namespace scanrig {

/// Lets `write` fill a temporary folder beside `folder`, syncs its files and renames it: `folder` is whole or not
/// there. Fails with `exists`, `io`, and as `write`; the temporary folder is removed then.
Result<void> publish_folder(const std::filesystem::path& folder,
                            const std::function<Result<void>(const std::filesystem::path&)>& write);

}  // namespace scanrig
