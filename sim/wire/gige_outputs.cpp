#include "sim/wire/gige_outputs.h"

#include <arv.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace scanrig::sim::wire {
namespace {

// Registers that Aravis' camera does not use; mode and source have a word for each line.
constexpr std::uint32_t kSelector = 0xe000, kMode = 0xe100, kSource = 0xe200, kUserSelector = 0xe300,
                        kUserValue = 0xe304;
constexpr std::uint32_t kWord = 4;
constexpr std::uint32_t kOutput = 1;                    // of LineMode
constexpr std::uint32_t kOff = 0, kExposureActive = 1;  // of LineSource; Off or UserOutput1

constexpr std::array<std::pair<std::string_view, GigeOutputs>, 4> kNames{
    {{"full", GigeOutputs::full},
     {"none", GigeOutputs::none},
     {"no-exposure-active", GigeOutputs::no_exposure_active},
     {"user-output", GigeOutputs::user_output}}};

struct Entry {
  std::string name;
  std::uint32_t value;
};

std::string hex(std::uint32_t number) {
  std::array<char, 16> text{};
  g_snprintf(text.data(), text.size(), "0x%x", number);
  return text.data();
}

std::string reg(const std::string& name, std::uint32_t address, const std::string& index) {
  return "<IntReg Name=\"" + name + "\"><Address>" + hex(address) + "</Address>" +
         (index.empty() ? "" : "<pIndex Offset=\"4\">" + index + "</pIndex>") +
         "<Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
         "<Endianess>BigEndian</Endianess></IntReg>\n";
}

std::string enumeration(const std::string& name, std::uint32_t address, const std::string& index,
                        const std::vector<Entry>& entries) {
  std::string text = "<Enumeration Name=\"" + name + "\">";
  for (const Entry& entry : entries) {
    text += "<EnumEntry Name=\"" + entry.name + "\"><Value>" + std::to_string(entry.value) + "</Value></EnumEntry>";
  }
  return text + "<pValue>" + name + "Reg</pValue></Enumeration>\n" + reg(name + "Reg", address, index);
}

std::uint32_t read(ArvFakeCamera* camera, std::uint32_t address) {
  std::uint32_t value = 0;
  arv_fake_camera_read_register(camera, address, &value);
  return value;
}

}  // namespace

std::optional<GigeOutputs> parse_gige_outputs(std::string_view word) {
  for (const auto& [name, outputs] : kNames) {
    if (name == word) return outputs;
  }
  return std::nullopt;
}

std::string describe_outputs(GigeOutputs outputs) {
  if (outputs == GigeOutputs::none) return {};
  const bool user = outputs == GigeOutputs::user_output;
  std::vector<Entry> sources{{user ? "UserOutput1" : "Off", kOff}};
  if (outputs != GigeOutputs::no_exposure_active) sources.push_back({"ExposureActive", kExposureActive});
  const std::string selector = "LineSelectorReg";
  std::string text = enumeration("LineSelector", kSelector, "", {{"Line0", 0}, {"Line1", 1}, {"Line2", 2}}) +
                     enumeration("LineMode", kMode, selector, {{"Input", 0}, {"Output", kOutput}}) +
                     enumeration("LineSource", kSource, selector, sources);
  if (!user) return text;
  return text + enumeration("UserOutputSelector", kUserSelector, "", {{"UserOutput1", 0}}) +
         "<Boolean Name=\"UserOutputValue\"><pValue>UserOutputValueReg</pValue><OnValue>1</OnValue>"
         "<OffValue>0</OffValue></Boolean>\n" +
         reg("UserOutputValueReg", kUserValue, "");
}

std::optional<int> output_while_exposing(ArvFakeCamera* camera) {
  for (const int line : {1, 2}) {
    const auto offset = kWord * static_cast<std::uint32_t>(line);
    if (read(camera, kMode + offset) == kOutput && read(camera, kSource + offset) == kExposureActive) return line;
  }
  return std::nullopt;
}

}  // namespace scanrig::sim::wire
