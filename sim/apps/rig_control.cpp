#include "sim/apps/rig_control.h"

#include <fmt/ranges.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>

namespace scanrig::sim {
namespace {

using nlohmann::json;
using Kind = wire::WireFault::Kind;

constexpr std::size_t kMaxAtOnce = 20000;  ///< frames or changes in one reply

std::int64_t nanoseconds(Clock::TimePoint at) { return at.time_since_epoch().count(); }

const std::map<std::string, Kind>& fault_kinds() {
  static const std::map<std::string, Kind> kinds{{"silent", Kind::request_lost},
                                                 {"reply_lost", Kind::reply_lost},
                                                 {"answer_lost", Kind::reply_lost},  // old name
                                                 {"late", Kind::late},
                                                 {"wrong_crc", Kind::wrong_crc},
                                                 {"short_frame", Kind::cut_short},
                                                 {"refuse", Kind::refuse},
                                                 {"earlier_reply", Kind::earlier_reply},
                                                 {"earlier_answer", Kind::earlier_reply}};  // old name
  return kinds;
}

/// "none", or a fault with its "fault_count" (requests, -1: all), "fault_delay_ms" and "fault_function".
Result<std::optional<wire::WireFault>> fault_of(const std::string& name, const json& all) {
  if (name == "none") return std::nullopt;
  const auto kind = fault_kinds().find(name);
  if (kind == fault_kinds().end()) return fail(ErrorCode::invalid_input, "no fault \"{}\"", name);
  wire::WireFault fault{.kind = kind->second};
  fault.count = all.value("fault_count", -1);
  fault.delay = std::chrono::milliseconds(all.value("fault_delay_ms", 200));
  if (all.contains("fault_function")) fault.function = all["fault_function"].get<std::uint8_t>();
  return fault;
}

Result<RigPanel::Wiring> wiring_of(const std::string& name) {
  using Wiring = RigPanel::Wiring;
  static const std::map<std::string, Wiring> words{
      {"wired", Wiring::wired}, {"broken", Wiring::broken}, {"bridged", Wiring::bridged}};
  const auto found = words.find(name);
  if (found == words.end()) return fail(ErrorCode::invalid_input, "a wire is wired, broken or bridged");
  return found->second;
}

Result<wire::Parity> parity_of(const std::string& name) {
  using wire::Parity;
  static const std::map<std::string, Parity> words{
      {"none", Parity::none}, {"even", Parity::even}, {"odd", Parity::odd}};
  const auto found = words.find(name);
  if (found == words.end()) return fail(ErrorCode::invalid_input, "a parity is none, even or odd");
  return found->second;
}

json to_json(const RigTruth& truth) {
  return {{"angle_deg", truth.angle_deg},       {"speed_deg_s", truth.speed_deg_s}, {"stopped", truth.stopped},
          {"projector_on", truth.projector_on}, {"counter", truth.counter},         {"powered", truth.powered}};
}

json to_json(const wire::WireFrame& frame, std::size_t number) {
  return {{"n", number},
          {"at_ns", nanoseconds(frame.at)},
          {"from_master", frame.from_master},
          {"bytes", fmt::format("{:02X}", fmt::join(frame.bytes, " "))}};
}

json to_json(const RigPanel::Change& change, std::size_t number) {
  return {{"n", number}, {"at_ns", nanoseconds(change.at)}, {"name", change.name}, {"on", change.on}};
}

json to_json(const RigExposure& exposure, std::size_t number) {
  return {{"n", number},
          {"at_ns", nanoseconds(exposure.at)},
          {"ended_ns", nanoseconds(exposure.ended)},
          {"read_ns", nanoseconds(exposure.read)},
          {"pattern", exposure.pattern},
          {"lit", exposure.lit},
          {"angle_deg", exposure.place.angle_deg},
          {"placement", exposure.place.placement}};
}

json to_json(const wire::AxisLeg& leg, std::size_t number) {
  return {{"n", number},
          {"begun_ns", nanoseconds(leg.begun)},
          {"ended_ns", nanoseconds(leg.ended)},
          {"from_deg", leg.from_deg},
          {"to_deg", leg.to_deg}};
}

/// Entries from number `since` on; "next" is the number for the next request.
template <class Entry>
json since(const char* name, const std::vector<Entry>& all, std::size_t since) {
  json list = json::array();
  std::size_t next = std::min(since, all.size());
  for (; next < all.size() && list.size() < kMaxAtOnce; ++next) list.push_back(to_json(all[next], next));
  return {{name, list}, {"next", next}};
}

}  // namespace

std::string RigControl::reply_to(const std::string& line) {
  const auto dumped = [](const json& reply) { return reply.dump(-1, ' ', false, json::error_handler_t::replace); };
  try {
    const auto done = obey(json::parse(line));
    return dumped(done ? *done : json{{"error", done.error().message}});
  } catch (const json::exception& wrong) {
    return dumped({{"error", wrong.what()}});
  }
}

Result<json> RigControl::obey(const json& request) {
  if (request.contains("get")) return get(request);
  if (request.contains("set")) {
    for (const auto& [knob, value] : request["set"].items()) {
      if (auto done = set(knob, value, request["set"]); !done) return pass_on(done);
    }
    return json{{"ok", true}, {"at_ns", nanoseconds(clock_.now())}};
  }
  for (const bool press : {true, false}) {
    const char* verb = press ? "press" : "release";
    if (!request.contains(verb)) continue;
    const auto at = rig_.press(request[verb].get<std::string>(), press);
    if (!at) return pass_on(at);
    return json{{"ok", true}, {"at_ns", nanoseconds(*at)}};
  }
  if (request.contains("turn_over") || request.contains("write_truth")) {
    const auto cameras = this->cameras();
    if (!cameras) return pass_on(cameras);
    if (request.contains("turn_over")) {
      (*cameras)->turned_over();
    } else if (auto done = (*cameras)->write_truth(request["write_truth"].get<std::string>()); !done) {
      return pass_on(done);
    }
    return json{{"ok", true}};
  }
  return fail(ErrorCode::invalid_input, "a request has one of: get, set, press, release, turn_over, write_truth");
}

Result<json> RigControl::get(const json& request) {
  const auto what = request["get"].get<std::string>();
  const auto from = request.value("since", std::size_t{0});
  if (what == "truth") return to_json(rig_.truth());
  if (what == "frames") return since("frames", rig_.frames(), from);
  if (what == "panel_frames" && rig_.panel().module_port()) {
    return since("frames", rig_.panel().module_port()->log(), from);
  }
  if (what == "changes") return since("changes", rig_.panel().changes(), from);
  if (what == "legs") return since("legs", rig_.drive().legs(), from);
  if (what == "exposures") {
    const auto cameras = this->cameras();
    if (!cameras) return pass_on(cameras);
    return since("exposures", (*cameras)->exposures(), from);
  }
  if (what == "inputs") return json(rig_.panel().inputs());
  if (what == "outputs") return json(rig_.panel().outputs());
  return fail(ErrorCode::invalid_input,
              "get one of: truth, frames, panel_frames (of a module), changes, inputs, outputs, legs, exposures; not "
              "\"{}\"",
              what);
}

Result<RigCameras*> RigControl::cameras() {
  if (rig_.cameras()) return rig_.cameras();
  return fail(ErrorCode::invalid_input, "this rig has no cameras on the wire: start it with --cameras gige");
}

/// Knobs of one camera, "camera": "left" or "right"; nothing for any other name.
std::optional<Result<void>> RigControl::set_camera(const std::string& knob, const json& value, const json& all) {
  if (knob != "camera_fault" && knob != "camera_unplugged") return std::nullopt;
  const auto cameras = this->cameras();
  if (!cameras) return pass_on(cameras);
  const auto name = all.value("camera", "");
  if (name != "left" && name != "right") {
    return fail(ErrorCode::invalid_input, "name the \"camera\" beside {}: left or right", knob);
  }
  const auto side = name == "left" ? wire::Side::left : wire::Side::right;
  if (knob == "camera_unplugged") return (*cameras)->wire().plug(side, !value.get<bool>());
  const auto fault = wire::parse_gige_fault(value.get<std::string>());
  if (!fault) return fail(ErrorCode::invalid_input, "no camera fault {}", value.dump());
  (*cameras)->wire().inject(side, *fault, all.value("fault_count", 1));
  return Result<void>();
}

/// The lights as the cameras see them; nothing for any other name.
std::optional<Result<void>> RigControl::set_light(const std::string& knob, const json& value) {
  if (knob != "light") return std::nullopt;
  const auto cameras = this->cameras();
  if (!cameras) return pass_on(cameras);
  const RigLights sound;
  (*cameras)->set_lights({.pattern = value.value("pattern", sound.pattern),
                          .plain = value.value("plain", sound.plain),
                          .room = value.value("room", sound.room),
                          .is_slide_in = value.value("slide", sound.is_slide_in),
                          .change_per_s = value.value("change_per_s", sound.change_per_s)});
  return Result<void>();
}

/// Knobs of the panel and of the wiring; nothing for any other name.
std::optional<Result<void>> RigControl::set_panel(const std::string& knob, const json& value, const json& all) {
  auto* module = rig_.panel().module_port();
  if (knob == "wiring") {
    for (const auto& [input, word] : value.items()) {
      const auto wiring = wiring_of(word.get<std::string>());
      if (!wiring) return pass_on(wiring);
      if (auto done = rig_.panel().rewire(input, *wiring); !done) return done;
    }
    return Result<void>();
  }
  if (knob != "panel_fault" && knob != "panel_unplugged") return std::nullopt;
  if (!module)
    return fail(ErrorCode::invalid_input, "this rig's panel is on GPIO: its lines have no faults and no plug");
  if (knob == "panel_fault") {
    const auto fault = fault_of(value.get<std::string>(), all);
    if (!fault) return pass_on(fault);
    module->clear_faults();
    if (*fault) module->inject(**fault);
    return Result<void>();
  }
  if (!value.get<bool>()) return module->come_back();
  module->vanish();
  return Result<void>();
}

/// Knobs of the drive's port; nothing for any other name.
std::optional<Result<void>> RigControl::set_port(const std::string& knob, const json& value, const json& all) {
  if (knob == "fault") {
    const auto fault = fault_of(value.get<std::string>(), all);
    if (!fault) return pass_on(fault);
    rig_.set_fault(*fault);
  } else if (knob == "unplugged") {
    return rig_.plug_in(!value.get<bool>());
  } else if (knob == "line") {
    const auto parity = parity_of(value.value("parity", "none"));
    if (!parity) return pass_on(parity);
    rig_.set_line({value.value("baud", 115200), *parity});
  } else {
    return std::nullopt;
  }
  return Result<void>();
}

Result<void> RigControl::set(const std::string& knob, const json& value, const json& all) {
  static const std::vector<std::string> companions{"fault_count", "fault_delay_ms", "fault_function",
                                                   "alarm_can_be_reset", "camera"};
  if (std::ranges::find(companions, knob) != companions.end()) return {};
  if (auto done = set_panel(knob, value, all)) return *done;
  if (auto done = set_port(knob, value, all)) return *done;
  if (auto done = set_camera(knob, value, all)) return *done;
  if (auto done = set_light(knob, value)) return *done;
  auto& drive = rig_.drive();
  const std::map<std::string, std::function<void()>> knobs{
      {"blocked", [&] { drive.block(value.get<bool>()); }},
      {"lost_steps", [&] { drive.lose_steps(value.get<double>()); }},
      {"counter", [&] { drive.preload_counter(value.get<int>()); }},
      {"power_cycle", [&] { drive.power_cycle(); }},
      {"alarm", [&] { drive.raise_alarm(value.get<std::uint16_t>(), all.value("alarm_can_be_reset", true)); }},
      {"physics",
       [&] {
         const wire::AxisOptions rest;
         drive.set_physics({.backlash_deg = value.value("backlash_deg", rest.backlash_deg),
                            .vibration_deg = value.value("vibration_deg", rest.vibration_deg),
                            .vibration_decay_s = value.value("vibration_decay_s", rest.vibration_decay_s)});
       }},
      {"estop_cuts_power", [&] { rig_.set_estop_cuts_power(value.get<bool>()); }},
      {"positive", [&] { rig_.set_positive_ccw(value.get<std::string>() == "ccw"); }}};
  const auto found = knobs.find(knob);
  if (found == knobs.end()) return fail(ErrorCode::invalid_input, "no knob \"{}\"", knob);
  found->second();
  return {};
}

}  // namespace scanrig::sim
