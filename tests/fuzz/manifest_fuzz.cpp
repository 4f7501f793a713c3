#include <cstdlib>

#include "pipeline/storage/manifest.h"
#include "tests/fuzz/input_file.h"

// A scan.json is any text: a manifest with valid strings, or an error that names the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = scanrig::input_file(data, size, "json");
  const auto manifest = scanrig::read_manifest(file);
  if (!manifest && manifest.error().message.find(file.filename().string()) == std::string::npos) std::abort();
  if (manifest && !scanrig::check_words(*manifest)) std::abort();
  std::filesystem::remove(file);
  return 0;
}
