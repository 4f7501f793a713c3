#include "drivers/camera/aravis_strobe.h"

#include <array>

namespace scanrig {
namespace {

constexpr const char* kSelector = "LineSelector";
constexpr const char* kSource = "LineSource";
constexpr const char* kExposing = "ExposureActive";

// Cameras without Off have an output that the host sets. SFNC counts these from 0, some makers from 1.
constexpr std::array kOffSources{"Off", "UserOutput0", "UserOutput1", "UserOutput2", "UserOutput3"};

/// Source of the selected output that keeps it off; nothing if there is none.
std::string off_source(ArvCamera* camera) {
  for (const char* source : kOffSources) {
    if (has_entry(camera, kSource, source)) return source;
  }
  return {};
}

Result<void> clear_user_output(ArvCamera* camera, const std::string& source, const GenicamCall& attempt) {
  if (source == kOffSources.front()) return {};
  if (auto set = set_text(camera, "UserOutputSelector", source, attempt); !set) return set;
  return attempt("set UserOutputValue",
                 [&](GError** error) { arv_camera_set_boolean(camera, "UserOutputValue", FALSE, error); });
}

/// A line that is an output by its hardware may reject LineMode.
Result<void> make_output(ArvCamera* camera, const GenicamCall& attempt) {
  if (!has_feature(camera, "LineMode")) return {};
  std::string mode;
  auto read = attempt("read LineMode", [&](GError** error) {
    if (const char* text = arv_camera_get_string(camera, "LineMode", error)) mode = text;
  });
  if (!read || mode == "Output") return read;
  return set_text(camera, "LineMode", "Output", attempt);
}

Result<void> set_up_output(ArvCamera* camera, const std::string& output, const GenicamCall& attempt) {
  if (!has_entry(camera, kSelector, output)) {
    return fail(ErrorCode::unsupported, "{}: its {} has no {}; name one of its outputs in [projector]", attempt.who(),
                kSelector, output);
  }
  if (auto set = set_text(camera, kSelector, output, attempt); !set) return set;
  if (auto set = make_output(camera, attempt); !set) return set;
  if (!has_feature(camera, kSource) || !has_entry(camera, kSource, kExposing)) {
    return fail(ErrorCode::unsupported, "{}: {} has no {} {}: it cannot fire the projector; use another output",
                attempt.who(), output, kSource, kExposing);
  }
  const std::string off = off_source(camera);
  if (off.empty()) {
    return fail(ErrorCode::unsupported, "{}: {} has no {} that keeps it off (Off or UserOutput0); use another output",
                attempt.who(), output, kSource);
  }
  if (auto cleared = clear_user_output(camera, off, attempt); !cleared) return cleared;
  return set_text(camera, kSource, off, attempt);
}

Result<void> set_source(ArvCamera* camera, const std::string& output, bool exposing, const GenicamCall& attempt) {
  if (auto set = set_text(camera, kSelector, output, attempt); !set) return set;
  return set_text(camera, kSource, exposing ? kExposing : off_source(camera), attempt);
}

}  // namespace

Result<void> set_up_outputs(ArvCamera* camera, const std::vector<std::string>& outputs, const GenicamCall& attempt) {
  if (outputs.empty()) return {};
  if (!has_feature(camera, kSelector)) {
    return fail(ErrorCode::unsupported, "{}: the camera has no {}: it cannot fire the projector; use another driver",
                attempt.who(), kSelector);
  }
  for (const std::string& output : outputs) {
    if (auto set = set_up_output(camera, output, attempt); !set) return set;
  }
  return {};
}

Result<void> select_output(ArvCamera* camera, const std::vector<std::string>& outputs, const std::string& selected,
                           const GenicamCall& attempt) {
  for (const std::string& output : outputs) {
    if (output == selected) continue;
    if (auto set = set_source(camera, output, false, attempt); !set) return set;
  }
  if (selected.empty()) return {};
  return set_source(camera, selected, true, attempt);
}

}  // namespace scanrig
