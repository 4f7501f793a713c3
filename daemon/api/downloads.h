#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
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

/// Bytes of a file, `end` not included.
struct FilePart {
  std::uint64_t begin = 0, end = 0;
  bool operator==(const FilePart&) const = default;
};

/// The part that the header Range names [RFC 9110, 14.2]: all of it without one, and for several ranges or what is
/// no range of bytes. Nothing: it begins behind the file's end.
std::optional<FilePart> part_of_file(std::string_view range, std::uint64_t size);

/// Media type by the file's ending: "model/gltf-binary", "image/png", ...
std::string_view media_type(std::string_view path);

/// Packs a job into a separate file beside the jobs and sends it; the file's name is gone before the first byte is.
void send_bundle(const ApiStation& station, const Values& values, Send send);

/// Deletes what a daemon that died while packing has left.
void remove_old_bundles(const std::filesystem::path& storage);

}  // namespace scanrig
