#include "config/pin.h"

namespace scanrig::config {
namespace {

void read_chip(Section& s, Pin& pin) {
  s.text("chip", pin.chip);
  s.number("offset", pin.offset, {0, 4095});
}

void read_bias(Section& s, gpio::Bias& bias) {
  using gpio::Bias;
  if (!s.has("bias")) return;
  s.choice<Bias>("bias", bias,
                 {{"pull-up", Bias::pull_up},
                  {"pull-down", Bias::pull_down},
                  {"disabled", Bias::disabled},
                  {"as-is", Bias::as_is}});
}

}  // namespace

Pin read_pin(Section& section, std::string_view key, Wiring wiring) {
  Pin pin;
  section.section(key, [&](Section& s) {
    if (wiring == Wiring::channel) {
      s.number("channel", pin.channel, {0, 255});
    } else if (s.has("chip")) {
      read_chip(s, pin);
    } else {
      s.text("line", pin.line);
    }
    if (s.has("active")) s.choice<bool>("active", pin.active_low, {{"low", true}, {"high", false}});
    if (wiring == Wiring::gpio_input) read_bias(s, pin.bias);
  });
  return pin;
}

Pin read_output_line(Section& section, std::string_view key) {
  Pin pin;
  if (section.is_table(key)) {
    section.section(key, [&](Section& s) { read_chip(s, pin); });
  } else {
    section.text(key, pin.line);
  }
  return pin;
}

void report_shared(Section& s, const std::map<std::string, Pin>& pins, const std::map<std::string, Pin>& others) {
  const auto compare = [&](const std::string& key, const Pin& pin, const std::map<std::string, Pin>& with) {
    for (const auto& [name, other] : with) {
      if (name == key || !pin.is_same_contact(other)) continue;
      return s.report(key, fmt::format("is on the same contact as {}", name));
    }
  };
  for (auto pin = pins.begin(); pin != pins.end(); ++pin) {
    compare(pin->first, pin->second, {pins.begin(), pin});
    compare(pin->first, pin->second, others);
  }
}

}  // namespace scanrig::config
