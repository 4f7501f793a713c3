#include "sim/apps/scanrig_sim_ctl.h"

#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "sim/wire/control_socket.h"

namespace scanrig::sim {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kTap{200};  ///< like a hand; a panel debounces for 50 ms

/// A number, true, false or null as such, all other words as text.
json value_of(const std::string& word) {
  auto value = json::parse(word, nullptr, false);
  return value.is_discarded() || value.is_structured() ? json(word) : value;
}

}  // namespace

Result<std::string> control_request(const std::vector<std::string>& words) {
  const auto wrong = [] {
    return fail(ErrorCode::invalid_input,
                "give one of: get WHAT [SINCE], set KEY=VALUE..., press|release|tap INPUT, or a JSON object");
  };
  if (words.empty()) return wrong();
  if (words[0].starts_with('{')) return words[0];
  if (words.size() < 2) return wrong();
  json request;
  if (words[0] == "get") {
    request["get"] = words[1];
    if (words.size() > 2) request["since"] = value_of(words[2]);
  } else if (words[0] == "set") {
    for (auto word = words.begin() + 1; word != words.end(); ++word) {
      const auto equals = word->find('=');
      if (equals == std::string::npos) return wrong();
      request["set"][word->substr(0, equals)] = value_of(word->substr(equals + 1));
    }
  } else if (words[0] == "press" || words[0] == "release") {
    request[words[0]] = words[1];
  } else {
    return wrong();
  }
  return request.dump();
}

Result<std::string> control(const std::filesystem::path& folder, const std::vector<std::string>& words) {
  if (words.size() == 2 && words[0] == "tap") {
    if (auto pressed = control(folder, {"press", words[1]}); !pressed) return pressed;
    RealClock().sleep_for(kTap);
    return control(folder, {"release", words[1]});
  }
  const auto request = control_request(words);
  if (!request) return request;
  auto reply = wire::send_to_control_socket(folder / "control.sock", *request);
  if (!reply) return reply;
  const auto parsed = json::parse(*reply, nullptr, false);
  if (parsed.is_object() && parsed.contains("error")) {
    return fail(ErrorCode::invalid_input, "{}", parsed["error"].dump());
  }
  return reply;
}

}  // namespace scanrig::sim
