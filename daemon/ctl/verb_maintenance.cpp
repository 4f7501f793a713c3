#include <nlohmann/json.hpp>

#include "daemon/ctl/client.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

void print_io(const nlohmann::json& io) {
  for (const char* side : {"inputs", "outputs"}) {
    fmt::print("{}\n", side);
    for (const auto& [name, value] : io.at(side).items()) fmt::print("  {:<14} {}\n", name, value.get<bool>() ? 1 : 0);
  }
}

std::string body_of(const MaintenanceVerb& verb) {
  if (verb.what != "jog") return "";
  const bool to = verb.to_deg.has_value();
  return nlohmann::json{{to ? "to_deg" : "by_deg", to ? *verb.to_deg : verb.by_deg.value_or(0.0)},
                        {"speed_deg_s", verb.speed_deg_s}}
      .dump();
}

}  // namespace

ExitCode maintenance(const Connection& connection, const MaintenanceVerb& verb) {
  const bool io = verb.what == "io";
  if (verb.what == "jog" && verb.to_deg.has_value() == verb.by_deg.has_value()) {
    return report_error(ExitCode::usage, "maintenance jog needs --to or --by");
  }
  const auto answer = io ? send_request(connection.socket, "GET", "/api/v1/io")
                         : send_request(connection.socket, "POST", "/api/v1/maintenance/" + verb.what, body_of(verb));
  if (!answer) return report_error(answer.error().exit, answer.error().message);
  if (connection.json) {
    fmt::print("{}\n", answer->dump(2));
  } else if (io) {
    print_io(*answer);
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
