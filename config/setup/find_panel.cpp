#include "config/setup/find_panel.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "drivers/discovery/panel_wiring.h"

namespace scanrig::config::setup {
namespace {

using discovery::IoModuleProbe;
using std::chrono::seconds;

constexpr seconds kPressLimit{60};
constexpr int kMaxOutputs = 16;
constexpr const char* kPatternLine = "PROJ_TRIG";
constexpr const char* kPlainLine = "PROJ_PLAIN";

struct Signal {
  std::string key;   ///< in rig.toml
  std::string line;  ///< GPIO line of that signal in the example
  std::string what;  ///< for the person
  bool is_needed;
};

const std::vector<Signal>& buttons() {
  static const std::vector<Signal> all{{"start", "START", "Start", true},
                                       {"reset", "RESET", "Reset", true},
                                       {"stop", "STOP", "Stop (not the emergency stop)", false}};
  return all;
}

/// Contacts of an automation.
const std::vector<Signal>& contacts() {
  static const std::vector<Signal> all{{"part_present", "PART_PRESENT", "", false}, {"flipped", "FLIPPED", "", false}};
  return all;
}

const std::vector<Signal>& lamps() {
  static const std::vector<Signal> all{{"lamp_red", "LAMP_RED", "red lamp", true},
                                       {"lamp_amber", "LAMP_AMBER", "amber lamp", false},
                                       {"lamp_green", "LAMP_GREEN", "green lamp", false},
                                       {"start_lamp", "START_LAMP", "lamp in the Start button", false},
                                       {"flip_request", "FLIP", "flip lamp", false},
                                       {"busy", "BUSY", "busy, to an automation", false},
                                       {"pass", "PASS", "pass", false},
                                       {"fail", "FAIL", "fail", false}};
  return all;
}

/// Everything that an output may switch.
std::vector<Signal> outputs() {
  auto all = lamps();
  all.push_back({"pattern", kPatternLine, "the projector's pattern", false});
  all.push_back({"plain", kPlainLine, "the projector's plain light", false});
  return all;
}

Pin line_of(const std::string& name, bool active_low) {
  Pin pin;
  pin.line = name;
  pin.active_low = active_low;
  return pin;
}

Pin channel_of(int channel, bool active_low) {
  Pin pin;
  pin.channel = channel;
  pin.active_low = active_low;
  return pin;
}

/// A closed contact pulls its line low, as in config/rigs/example.toml.
Result<PanelWiring> wiring_of_lines(const std::vector<std::string>& found) {
  const auto is_there = [&](const std::string& name) { return std::ranges::find(found, name) != found.end(); };
  PanelWiring wiring;
  wiring.panel.driver = PanelConfig::Driver::gpio;
  std::vector<std::string> missing;
  if (!is_there("ESTOP_OK")) missing.emplace_back("ESTOP_OK");
  wiring.estop = line_of("ESTOP_OK", true);
  if (is_there("GUARD_OK")) wiring.guard = line_of("GUARD_OK", true);
  for (const auto* signals : {&buttons(), &contacts()}) {
    for (const auto& signal : *signals) {
      if (is_there(signal.line)) wiring.panel.inputs[signal.key] = line_of(signal.line, true);
      if (signal.is_needed && !is_there(signal.line)) missing.push_back(signal.line);
    }
  }
  for (const auto& lamp : lamps()) {
    if (is_there(lamp.line)) wiring.panel.outputs[lamp.key] = line_of(lamp.line, false);
    if (lamp.is_needed && !is_there(lamp.line)) missing.push_back(lamp.line);
  }
  if (!missing.empty()) {
    return fail(ErrorCode::not_found,
                "setup: there is no GPIO line named {}; name the lines in the device tree, or copy the shipped example "
                "and name them by chip and offset",
                fmt::join(missing, ", "));
  }
  return wiring;
}

/// Finds the channel of one contact by its change.
class ModuleWiring {
 public:
  ModuleWiring(IoModuleProbe& probe, const Dialogue& dialogue, Clock& clock)
      : probe_(probe), dialogue_(dialogue), clock_(clock) {}

  /// `do_it` and `undo_it`: what the person does. Fails with `not_found`.
  Result<discovery::ChangedInput> find(const std::string& what, const std::string& do_it, const std::string& undo_it) {
    dialogue_.tell(fmt::format("{} within {} s.", do_it, kPressLimit.count()));
    const auto changed = probe_.wait_for_change(Deadline::after(clock_, kPressLimit));
    if (!changed) return pass_on(changed);
    if (!*changed) {
      return fail(ErrorCode::not_found, "setup: no input of the I/O module changed with {}; check its wires", what);
    }
    dialogue_.tell(fmt::format("  Input {}. {}.", (*changed)->channel, undo_it));
    const auto rested = probe_.wait_for_rest(Deadline::after(clock_, kPressLimit));
    if (!rested) return pass_on(rested);
    if (!*rested) return fail(ErrorCode::not_found, "setup: {} did not return; check its contact", what);
    return **changed;
  }

  Result<void> find_inputs(PanelWiring& wiring) {
    for (const auto& button : buttons()) {
      if (!button.is_needed) {
        const auto has_it = dialogue_.prompt_yes_or_no(fmt::format("Is there a button {}?", button.what));
        if (!has_it) return pass_on(has_it);
        if (!*has_it) continue;
      }
      const auto found = find(button.what, fmt::format("Press {} and hold it", button.what), "Release it");
      if (!found) return pass_on(found);
      wiring.panel.inputs[button.key] = channel_of(found->channel, !found->is_set);
    }
    const auto estop = find("the emergency stop", "Press the emergency stop", "Release the emergency stop");
    if (!estop) return pass_on(estop);
    wiring.estop = channel_of(estop->channel, estop->is_set);
    const auto has_guard = dialogue_.prompt_yes_or_no("Is there a guard with a switch?");
    if (!has_guard) return pass_on(has_guard);
    if (!*has_guard) return {};
    const auto guard = find("the guard", "Open the guard", "Close the guard");
    if (!guard) return pass_on(guard);
    wiring.guard = channel_of(guard->channel, guard->is_set);
    return {};
  }

  Result<void> find_outputs(PanelWiring& wiring) {
    const auto may_switch = dialogue_.prompt_yes_or_no(
        "The outputs of the module are switched on one after the other. May all of them be on?");
    if (!may_switch) return pass_on(may_switch);
    if (!*may_switch) {
      return fail(ErrorCode::refused,
                  "setup: without its outputs the panel has no lamp; disconnect what must not be "
                  "switched on, then run setup again");
    }
    auto left = outputs();
    for (int channel = 0; channel < std::min(probe_.outputs(), kMaxOutputs); ++channel) {
      std::vector<std::string> names{"nothing"};
      for (const auto& output : left) names.push_back(output.what);
      if (auto on = probe_.set_output(channel, true); !on) return on;
      const auto lit = dialogue_.choose(fmt::format("Output {} is on. What does it switch?", channel), names);
      if (auto off = probe_.set_output(channel, false); !off) return off;
      if (!lit) return pass_on(lit);
      if (*lit == 0) continue;
      const auto named = left.begin() + static_cast<std::ptrdiff_t>(*lit - 1);
      auto& pins = named->line == kPatternLine || named->line == kPlainLine ? wiring.lights : wiring.panel.outputs;
      pins[named->key] = channel_of(channel, false);
      left.erase(named);
    }
    if (wiring.panel.outputs.contains("lamp_red")) return {};
    return fail(ErrorCode::not_found,
                "setup: no output switches a red lamp, so a fault would not be visible; wire one");
  }

 private:
  IoModuleProbe& probe_;
  const Dialogue& dialogue_;
  Clock& clock_;
};

Result<PanelWiring> wiring_of_module(const discovery::SerialDevice& module, const Dialogue& dialogue, Clock& clock) {
  const auto begun = dialogue.wait_until_done("Close the guard and release every button and the emergency stop");
  if (!begun) return pass_on(begun);
  IoModuleProbe probe(module.line, clock);
  if (auto there = probe.begin(); !there) return pass_on(there, "setup");
  dialogue.tell(fmt::format("The module has {} inputs and {} outputs.", probe.inputs(), probe.outputs()));
  PanelWiring wiring;
  wiring.panel.driver = PanelConfig::Driver::modbus_io;
  wiring.panel.io_module = module.line;
  ModuleWiring by_hand(probe, dialogue, clock);
  if (auto found = by_hand.find_inputs(wiring); !found) return pass_on(found);
  if (auto found = by_hand.find_outputs(wiring); !found) return pass_on(found);
  return wiring;
}

}  // namespace

Result<PanelWiring> find_panel(gpio::Lines& lines, const std::vector<discovery::SerialDevice>& modules,
                               const Dialogue& dialogue, Clock& clock) {
  std::vector<std::string> names{"ESTOP_OK", "GUARD_OK", kPatternLine, kPlainLine};
  for (const auto* signals : {&buttons(), &contacts(), &lamps()}) {
    for (const auto& signal : *signals) names.push_back(signal.line);
  }
  const auto found = discovery::readable_lines(lines, names);
  const bool has_buttons = std::ranges::find(found, "START") != found.end();
  std::vector<std::string> ways;
  if (has_buttons) ways.push_back(fmt::format("GPIO lines: {}", fmt::join(found, " ")));
  for (const auto& module : modules) ways.push_back("the I/O module at " + module.line.device);
  if (ways.empty()) {
    return fail(ErrorCode::not_found,
                "setup: there is neither a GPIO line named START nor a Modbus I/O module; connect the panel, then run "
                "setup again");
  }
  const auto which = dialogue.choose("Where are buttons and lamps connected?", ways);
  if (!which) return pass_on(which);
  const bool by_lines = has_buttons && *which == 0;
  auto wiring =
      by_lines ? wiring_of_lines(found) : wiring_of_module(modules[*which - (has_buttons ? 1 : 0)], dialogue, clock);
  if (!wiring) return wiring;
  const auto is_there = [&](const char* name) { return std::ranges::find(found, name) != found.end(); };
  if (!wiring->lights.contains("pattern") && is_there(kPatternLine) && is_there(kPlainLine)) {
    wiring->lights = {{"pattern", line_of(kPatternLine, false)}, {"plain", line_of(kPlainLine, false)}};
  }
  if (by_lines) dialogue.tell(fmt::format("Buttons and lamps are on the GPIO lines {}.", fmt::join(found, " ")));
  return wiring;
}

}  // namespace scanrig::config::setup
