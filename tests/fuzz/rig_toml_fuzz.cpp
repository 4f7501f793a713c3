#include <cstdlib>

#include "config/rig_config.h"
#include "tests/fuzz/input_file.h"

// A rig.toml is any text: it is read whole, or every problem is reported; never half a rig.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = scanrig::input_file(data, size, "toml");
  const auto rig = scanrig::config::read_rig_config(file, std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/drives");
  if (!rig && rig.error().message.empty()) std::abort();
  if (rig && (!rig->recipes.contains("default") || !rig->panel.inputs.contains("start"))) std::abort();
  std::filesystem::remove(file);
  return 0;
}
