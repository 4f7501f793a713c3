#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>

#include "core/files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Feeds every file of a folder to the linked fuzz target.
int main(int argc, char** argv) {
  if (argc != 2) return 2;
  std::error_code error;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1], error)) {
    const auto input = scanrig::read_file(entry.path());
    if (!input) return 3;
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input->data()), input->size());
    ++count;
  }
  std::printf("%d inputs replayed\n", count);
  return count > 0 ? 0 : 3;
}
