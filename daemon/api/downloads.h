#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "daemon/api/route.h"

namespace scanrig {

struct FolderFile {
  std::string path;  ///< within the job's folder
  std::uint64_t bytes = 0;
};

/// Every regular file below a job's folder, in order of name; links are not followed. Fails with `io`.
Result<std::vector<FolderFile>> list_files(const std::filesystem::path& folder);

/// Opens a file below `folder`, component by component, following no link. Fails with `not_found`, `io`.
Result<std::shared_ptr<OpenFile>> open_below(const std::filesystem::path& folder, std::string_view path);

/// Media type by the file's ending: "model/gltf-binary", "image/png", ...
std::string_view media_type(std::string_view path);

/// Packs a job into a separate file beside the jobs and sends it; the file's name is gone before the first byte is.
void send_bundle(const ApiStation& station, const Values& values, Send send);

/// Deletes what a daemon that died while packing has left.
void remove_old_bundles(const std::filesystem::path& storage);

}  // namespace scanrig
