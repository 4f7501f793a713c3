#include "config/gpio_options.h"

namespace scanrig::config {
namespace {

gpio::LineSpec line_of(const Pin& pin) { return {pin.line, pin.active_low}; }

const std::map<std::string, bool PanelInputs::*>& inputs_by_key() {
  static const std::map<std::string, bool PanelInputs::*> fields{{"start", &PanelInputs::start},
                                                                 {"stop", &PanelInputs::stop},
                                                                 {"reset", &PanelInputs::reset},
                                                                 {"part_present", &PanelInputs::part_present}};
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

}  // namespace

GpioProjectorOptions gpio_projector_options(const ProjectorConfig& projector) {
  GpioProjectorOptions options;
  options.pattern_line = {projector.line, projector.active_low};
  if (projector.plain_line) options.plain_line = {*projector.plain_line, projector.active_low};
  options.pulse = projector.pulse;
  return options;
}

GpioPanelOptions gpio_panel_options(const RigConfig& rig) {
  GpioPanelOptions options;
  options.inputs.emplace_back(&PanelInputs::estop_ok, line_of(rig.safety.estop));
  if (rig.safety.guard) options.inputs.emplace_back(&PanelInputs::guard_closed, line_of(*rig.safety.guard));
  for (const auto& [key, pin] : rig.panel.inputs) options.inputs.emplace_back(inputs_by_key().at(key), line_of(pin));
  for (const auto& [key, pin] : rig.panel.outputs) options.outputs.emplace_back(outputs_by_key().at(key), line_of(pin));
  return options;
}

}  // namespace scanrig::config
