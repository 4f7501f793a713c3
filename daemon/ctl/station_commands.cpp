#include "daemon/ctl/client_command.h"

namespace scanrig::ctl {
namespace {

void add_button(CLI::App& app, Chosen& chosen, const char* name, const char* description) {
  add_client(app, chosen, name, description, std::make_shared<std::string>(name),
             [](const Connection& connection, const std::string& button) { return press(connection, button); });
}

void add_maintenance(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<MaintenanceVerb>();
  auto* sub =
      add_client(app, chosen, "maintenance", "home, jog and try the rig while no job can run", verb, maintenance);
  sub->add_option("WHAT", verb->what, "on, off, or what to do while it is on")
      ->required()
      ->check(CLI::IsMember({"on", "off", "home", "jog", "pulse", "lamp_test", "io"}));
  sub->add_option("--to", verb->to_deg, "jog: to this angle");
  sub->add_option("--by", verb->by_deg, "jog: by this much");
  sub->add_option("--speed", verb->speed_deg_s, "jog: deg/s")->capture_default_str();
}

}  // namespace

void add_station_commands(CLI::App& app, Chosen& chosen) {
  const auto look = std::make_shared<StatusVerb>();
  auto* sub = add_client(app, chosen, "status", "what the station does, why, and what to do next", look, status);
  auto* follow =
      sub->add_flag("--follow", look->follow, "follow the job that has the rig, or the next one, to its end");
  sub->add_flag("--watch", look->watch, "one screen, kept up to date until interrupted")->excludes(follow);
  const auto begin = std::make_shared<StartVerb>();
  add_client(app, chosen, "start", "start a scan; after the flip: continue", begin, start)
      ->add_flag("--follow", begin->follow, "follow the job to its end");
  const auto halt = std::make_shared<StopVerb>();
  add_client(app, chosen, "stop", "stop the table, in every state, and wait until it has stopped", halt, stop)
      ->add_flag("!--no-wait", halt->wait, "do not wait for standstill");
  add_button(app, chosen, "reset", "clear a fault and home the table");
  add_button(app, chosen, "reload", "begin again with the configuration file as it is now, while the rig is idle");
  add_client(app, chosen, "health", "devices, disk, temperatures, deadlines missed, retakes", std::make_shared<int>(),
             [](const Connection& connection, int) { return health(connection); });
  add_maintenance(app, chosen);
}

}  // namespace scanrig::ctl
