#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>

#include "config/drive_profile_file.h"

// A drive profile is any text: it is read whole, or every problem is reported; never half a profile.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto file =
      std::filesystem::temp_directory_path() / ("fuzz-profile-" + std::to_string(::getpid()) + ".toml");
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const auto profile = scanrig::config::read_drive_profile(file);
  if (!profile && profile.error().message.empty()) std::abort();
  if (profile && (profile->name.empty() || profile->move.words.empty())) std::abort();
  std::filesystem::remove(file);
  return 0;
}
