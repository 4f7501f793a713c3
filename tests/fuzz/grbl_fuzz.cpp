#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/turntable/grbl_protocol.h"

// A controller sends anything: each line is understood to the last character or is noise, never half a report.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using scanrig::grbl::Firmware;
  using scanrig::grbl::Line;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty()) {
    const auto end = rest.find('\n');
    const Line line = scanrig::grbl::parse_line(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    const bool is_text = line.kind == Line::Kind::setting && std::isnan(line.value);
    if (line.number < 0 || (!std::isfinite(line.value) && !is_text)) std::abort();
    for (const double position : line.report.position) {
      if (line.kind != Line::Kind::report || !std::isfinite(position)) std::abort();
    }
    if (line.report.position.size() > 9) std::abort();
    for (const auto firmware : {Firmware::grbl, Firmware::grblhal, Firmware::fluidnc}) {
      if (scanrig::grbl::alarm_of(line.number, firmware).words.empty()) std::abort();
      if (scanrig::grbl::error_words(line.number, firmware).empty()) std::abort();
    }
  }
  return 0;
}
