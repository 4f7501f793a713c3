#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "sim/apps/wire_rig.h"

namespace scanrig::sim {

/// Meaning of the lines on the control socket; the list is in sim/wire/README.md.
/// Threads: one at a time.
class RigControl {
 public:
  explicit RigControl(WireRig& rig, Clock& clock) : rig_(rig), clock_(clock) {}

  /// One request, one reply; a reply with "error" names what was not understood or failed.
  std::string reply_to(const std::string& line);

 private:
  Result<nlohmann::json> obey(const nlohmann::json& request);
  Result<nlohmann::json> get(const nlohmann::json& request);
  Result<RigCameras*> cameras();
  std::optional<Result<void>> set_camera(const std::string& knob, const nlohmann::json& value,
                                         const nlohmann::json& all);
  std::optional<Result<void>> set_panel(const std::string& knob, const nlohmann::json& value,
                                        const nlohmann::json& all);
  std::optional<Result<void>> set_port(const std::string& knob, const nlohmann::json& value, const nlohmann::json& all);
  std::optional<Result<void>> set_light(const std::string& knob, const nlohmann::json& value);
  Result<void> set(const std::string& knob, const nlohmann::json& value, const nlohmann::json& all);

  WireRig& rig_;
  Clock& clock_;
};

}  // namespace scanrig::sim
