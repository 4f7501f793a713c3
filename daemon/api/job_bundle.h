#pragma once

#include <filesystem>

#include "daemon/api/route.h"

namespace scanrig {

/// Packs a job into a separate file beside the jobs and sends it; the file's name is gone before the first byte is.
void send_bundle(const ApiStation& station, const Values& values, Send send);

/// Deletes what a daemon that died while packing has left.
void remove_old_bundles(const std::filesystem::path& storage);

}  // namespace scanrig
