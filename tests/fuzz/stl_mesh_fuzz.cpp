#include "tests/fuzz/mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return scanrig::mesh_fuzz(&scanrig::parse_stl, data, size);
}
