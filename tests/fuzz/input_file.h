#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace scanrig {

/// The fuzzer's bytes as a file of this process.
inline std::filesystem::path input_file(const std::uint8_t* data, std::size_t size, const std::string& ending) {
  const auto file =
      std::filesystem::temp_directory_path() / ("scanrig-fuzz-" + std::to_string(::getpid()) + "." + ending);
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return file;
}

}  // namespace scanrig
