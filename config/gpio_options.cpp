#include "config/gpio_options.h"

namespace scanrig::config {
namespace {

const std::map<std::string, bool PanelInputs::*>& inputs_by_key() {
  static const std::map<std::string, bool PanelInputs::*> fields{{"start", &PanelInputs::start},
                                                                 {"stop", &PanelInputs::stop},
                                                                 {"reset", &PanelInputs::reset},
                                                                 {"part_present", &PanelInputs::part_present},
                                                                 {"flipped", &PanelInputs::flipped}};
  return fields;
}

const std::map<std::string, bool PanelOutputs::*>& outputs_by_key() {
  static const std::map<std::string, bool PanelOutputs::*> fields{
      {"lamp_red", &PanelOutputs::red},     {"lamp_amber", &PanelOutputs::amber},
      {"lamp_green", &PanelOutputs::green}, {"start_lamp", &PanelOutputs::start_lamp},
      {"busy", &PanelOutputs::busy},        {"flip_request", &PanelOutputs::flip_request},
      {"pass", &PanelOutputs::pass},        {"fail", &PanelOutputs::fail}};
  return fields;
}

gpio::LineSpec line_spec(const Pin& pin) {
  return {.name = pin.line,
          .active_low = pin.active_low,
          .bias = pin.bias,
          .chip = pin.chip,
          .offset = static_cast<unsigned>(pin.offset)};
}

/// Every wired signal at its place, as `wiring` of the driver requires.
template <class Options, class Wiring>
Options panel_options(const RigConfig& rig, const Wiring& wiring) {
  Options options;
  options.inputs.emplace_back(&PanelInputs::estop_ok, wiring(rig.safety.estop));
  if (rig.safety.guard) options.inputs.emplace_back(&PanelInputs::guard_closed, wiring(*rig.safety.guard));
  for (const auto& [key, pin] : rig.panel.inputs) options.inputs.emplace_back(inputs_by_key().at(key), wiring(pin));
  for (const auto& [key, pin] : rig.panel.outputs) options.outputs.emplace_back(outputs_by_key().at(key), wiring(pin));
  return options;
}

}  // namespace

GpioProjectorOptions gpio_projector_options(const ProjectorConfig& projector) {
  GpioProjectorOptions options;
  options.pattern_line = line_spec(projector.line);
  if (projector.plain_line) options.plain_line = line_spec(*projector.plain_line);
  options.pulse = projector.pulse;
  return options;
}

ModbusIoProjectorOptions modbus_io_projector_options(const ProjectorConfig& projector) {
  ModbusIoProjectorOptions options;
  options.line = projector.io_module;
  options.pattern_coil = static_cast<std::uint16_t>(projector.line.channel);
  if (projector.plain_line) options.plain_coil = static_cast<std::uint16_t>(projector.plain_line->channel);
  options.active_low = projector.line.active_low;
  options.pulse = projector.pulse;
  return options;
}

CameraStrobeProjectorOptions camera_strobe_options(const RigConfig& rig) {
  CameraStrobeProjectorOptions options;
  options.pattern_output = rig.projector.line.line;
  if (rig.projector.plain_line) options.plain_output = rig.projector.plain_line->line;
  options.exposure = rig.stereo_camera.longest_exposure();
  return options;
}

GpioPanelOptions gpio_panel_options(const RigConfig& rig) { return panel_options<GpioPanelOptions>(rig, line_spec); }

ModbusIoPanelOptions modbus_io_panel_options(const RigConfig& rig) {
  auto options = panel_options<ModbusIoPanelOptions>(rig, [](const Pin& pin) {
    return ModbusIoPanelOptions::Signal{static_cast<std::uint16_t>(pin.channel), pin.active_low};
  });
  options.line = rig.panel.io_module;
  options.poll = rig.panel.poll;
  return options;
}

}  // namespace scanrig::config
