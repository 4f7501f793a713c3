#include "sim/apps/rig_panel.h"

#include <algorithm>
#include <array>

namespace scanrig::sim {
namespace {

struct Signal {
  const char* name;
  const char* line;
  std::size_t channel = 0;  ///< of the Modbus I/O module
};

constexpr std::array kInputs{Signal{"start", "START", 0},    Signal{"stop", "STOP", 1},
                             Signal{"reset", "RESET", 2},    Signal{"estop", "ESTOP_OK", 3},
                             Signal{"guard", "GUARD_OK", 4}, Signal{"part", "PART_PRESENT", 5},
                             Signal{"flipped", "FLIPPED", 6}};
constexpr std::array kLamps{Signal{"lamp_red", "LAMP_RED", 0},
                            Signal{"lamp_amber", "LAMP_AMBER", 1},
                            Signal{"lamp_green", "LAMP_GREEN", 2},
                            Signal{"start_lamp", "START_LAMP", 3},
                            Signal{"flip_request", "FLIP", 4},
                            Signal{"busy", "BUSY", 5},
                            Signal{"pass", "PASS", 6},
                            Signal{"fail", "FAIL", 7}};
constexpr std::uint8_t kModuleUnit = 2;
constexpr std::array kLights{Signal{"projector", "PROJ_TRIG"}, Signal{"plain_light", "PROJ_PLAIN"}};

}  // namespace

Result<std::unique_ptr<RigPanel>> RigPanel::start(const std::filesystem::path& folder, bool on_module, Clock& clock) {
  std::unique_ptr<RigPanel> panel(new RigPanel(clock));
  std::map<std::string, bool> levels;
  for (const Signal& input : kInputs) {
    const std::string name = input.name;
    const bool at_rest_pressed = name == "guard" || name == "part";
    panel->inputs_[name] = {
        .line = input.line, .channel = input.channel, .opens = name == "estop", .pressed = at_rest_pressed};
    levels[input.line] = name != "estop" && !at_rest_pressed;  // a closed contact pulls low
  }
  for (const Signal& lamp : kLamps) levels[lamp.line] = false;
  for (const Signal& light : kLights) levels[light.line] = false;
  auto gpio = wire::GpioSocket::start(folder / "gpio.sock", std::move(levels), clock);
  if (!gpio) return pass_on(gpio);
  panel->gpio_ = std::move(*gpio);
  if (on_module) {
    panel->module_ = std::make_unique<wire::ModbusIoModule>(kInputs.size(), kLamps.size());
    auto server = wire::ModbusServer::start(folder / "panel", kModuleUnit, *panel->module_, clock);
    if (!server) return pass_on(server);
    panel->server_ = std::move(*server);
  }
  for (const Signal& input : kInputs) panel->apply(input.name);
  return panel;
}

void RigPanel::apply(const std::string& name) {
  const Input& input = inputs_.at(name);
  bool closed = input.pressed != input.opens;
  if (input.wiring != Wiring::wired) closed = input.wiring == Wiring::bridged;
  gpio_->set(input.line, !closed);
  if (module_) module_->set(input.channel, closed);
}

Result<Clock::TimePoint> RigPanel::press(const std::string& name, bool pressed) {
  const std::scoped_lock lock(mutex_);
  const auto input = inputs_.find(name);
  if (input == inputs_.end()) return fail(ErrorCode::not_found, "the panel has no input \"{}\"", name);
  input->second.pressed = pressed;
  const auto at = clock_.now();
  apply(name);
  pressed_changes_.push_back({at, name, pressed});
  return at;
}

Result<void> RigPanel::rewire(const std::string& name, Wiring wiring) {
  const std::scoped_lock lock(mutex_);
  const auto input = inputs_.find(name);
  if (input == inputs_.end()) return fail(ErrorCode::not_found, "the panel has no input \"{}\"", name);
  input->second.wiring = wiring;
  apply(name);
  return {};
}

std::map<std::string, bool> RigPanel::inputs() const {
  const std::scoped_lock lock(mutex_);
  std::map<std::string, bool> all;
  for (const auto& [name, input] : inputs_) all[name] = input.pressed;
  return all;
}

bool RigPanel::pressed(const std::string& input) const {
  const std::scoped_lock lock(mutex_);
  return inputs_.at(input).pressed;
}

std::map<std::string, bool> RigPanel::outputs() const {
  std::map<std::string, bool> all;
  for (const Signal& lamp : kLamps) all[lamp.name] = module_ ? module_->coil(lamp.channel) : gpio_->level(lamp.line);
  for (const Signal& light : kLights) all[light.name] = gpio_->level(light.line);
  return all;
}

bool RigPanel::light() const {
  return std::ranges::any_of(kLights, [&](const Signal& light) { return gpio_->level(light.line); });
}

void RigPanel::on_light(std::function<void(bool pattern, bool on)> listener) {
  if (!listener) return gpio_->on_edge({});
  gpio_->on_edge([listener = std::move(listener)](const wire::GpioSocket::Edge& edge) {
    const auto light = std::ranges::find_if(kLights, [&](const Signal& signal) { return edge.line == signal.line; });
    if (light != kLights.end()) listener(light == kLights.begin(), edge.high);
  });
}

std::vector<RigPanel::Change> RigPanel::changes() const {
  std::vector<Change> all;
  {
    const std::scoped_lock lock(mutex_);
    all = pressed_changes_;
  }
  for (const auto& edge : gpio_->edges()) {
    const auto is_it = [&](const Signal& signal) { return edge.line == signal.line; };
    const auto lamp = std::ranges::find_if(kLamps, is_it);
    const auto light = std::ranges::find_if(kLights, is_it);
    const char* name = lamp != kLamps.end() ? lamp->name : light != kLights.end() ? light->name : edge.line.c_str();
    all.push_back({edge.at, name, edge.high});
  }
  std::ranges::sort(all, {}, &Change::at);
  return all;
}

}  // namespace scanrig::sim
