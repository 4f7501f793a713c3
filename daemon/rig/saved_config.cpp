#include "daemon/rig/saved_config.h"

#include <cstdlib>
#include <span>
#include <system_error>
#include <vector>

#include "core/files.h"

namespace scanrig {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

}  // namespace

std::filesystem::path saved_config_folder(const std::filesystem::path& file) {
  if (const char* runtime = std::getenv("RUNTIME_DIRECTORY")) return std::filesystem::path(runtime) / "running";
  return file.parent_path() / (file.stem().string() + ".running");
}

Result<void> save_config(const config::RigConfig& config, const std::filesystem::path& folder) {
  auto prepared = folder;
  prepared += ".new";
  std::error_code ignored;
  std::filesystem::remove_all(prepared, ignored);  // left by a daemon that died while it wrote
  if (auto made = create_directories_synced(prepared / "drives"); !made) return made;
  if (const auto& profile = config.turntable.profile_file) {
    const FileContent file{profile->name, bytes_of(profile->text)};
    if (auto written = write_files_synced(prepared / "drives", {&file, 1}); !written) return written;
  }
  const FileContent file{"rig.toml", bytes_of(config.text)};
  if (auto written = write_files_synced(prepared, {&file, 1}); !written) return written;
  return replace_folder(prepared, folder);
}

}  // namespace scanrig
