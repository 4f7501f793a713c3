#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/result.h"

namespace scanrig {

/// The whole file. Fails with `not_found` or `io`, naming the file.
Result<std::string> read_file(const std::filesystem::path& path);

/// Writes a file so that a crash or a power cut leaves either the old one or the new one: temporary name in the same
/// folder, fsync, rename, fsync of the folder. Fails with `io`; the temporary file is removed then.
Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// What write_file_atomically() left of `path` where its process ended before it did.
std::vector<std::filesystem::path> unfinished_writes(const std::filesystem::path& path);

struct FileContent {
  std::string name;  ///< within the folder
  std::span<const std::byte> bytes;
};
/// Writes several files of one folder, then syncs each of them and the folder once. Cheaper than one by one but not
/// atomic: for files that are not read until another file names them. Fails with `io`.
Result<void> write_files_synced(const std::filesystem::path& folder, std::span<const FileContent> files);

/// Deletes a file so that it stays deleted after a power cut. A missing file is no error. Fails with `io`.
Result<void> remove_file_synced(const std::filesystem::path& path);

/// Creates `path` and its parents and syncs each new entry's folder. Fails with `io`.
Result<void> create_directories_synced(const std::filesystem::path& path);

/// Puts the folder `prepared`, its files already synced, in the place of `target` on the same file system, and syncs.
/// An older `target` is exchanged in one step where the file system supports it, and deleted. Fails with `io`.
Result<void> replace_folder(const std::filesystem::path& prepared, const std::filesystem::path& target);

}  // namespace scanrig
