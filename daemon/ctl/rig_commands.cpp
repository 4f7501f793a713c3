#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/ctl/commands.h"
#include "daemon/ctl/motion_guardian.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

void add_turntable(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<TurntableVerb>();
  auto* sub = app.add_subcommand("turntable", "move or ask the turntable itself, while no daemon runs");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = sub->add_subcommand(name, description);
    action->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
    action->callback([&chosen, verb, name] {
      verb->what = name;
      chosen = [verb] { return turntable(*verb); };
    });
    return action;
  };
  auto* home = add("home", "find home");
  auto* move = add("move", "find home, then turn to ANGLE, the shorter way");
  move->add_option("ANGLE", verb->angle_deg, "degrees, counter-clockwise")->required();
  for (auto* action : {home, move}) action->add_flag("--yes", verb->yes, "nobody is near: do not ask");
  auto* status = add("status", "moving, home, alarm");
  auto* read = add("read", "what the drive's registers say");
  for (auto* action : {home, move, status, read}) action->add_flag("--json", verb->json, "print JSON");
}

void add_panel(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<PanelVerb>();
  auto* sub = app.add_subcommand("panel", "the panel itself, while no daemon runs");
  sub->require_subcommand(1);
  auto* watch = sub->add_subcommand("watch", "print buttons and contacts as they change");
  watch->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
  watch->add_option("--seconds", verb->seconds, "how long; 0: until interrupted")->check(CLI::Range(0, 86400));
  watch->add_flag("--json", verb->json, "print JSON, a line a change");
  watch->callback([&chosen, verb] { chosen = [verb] { return watch_panel(*verb); }; });
}

void add_doctor(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<DoctorVerb>();
  auto* sub = app.add_subcommand("doctor", "try everything the configuration names and tell what is wrong");
  sub->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
  sub->add_flag("--yes-move", verb->yes_move, "the table may turn: nobody is near it");
  sub->add_flag("--answers", verb->answers, "somebody answers on standard input although it is no terminal");
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return examine_rig(*verb); }; });
}

void add_camera(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<CameraVerb>();
  auto* sub = app.add_subcommand("camera", "the cameras themselves");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = sub->add_subcommand(name, description);
    action->callback([&chosen, verb, name] {
      verb->what = name;
      chosen = [verb] { return camera(*verb); };
    });
    return action;
  };
  add("list", "every camera on network, USB and V4L2, with its serial number")
      ->add_flag("--json", verb->json, "print JSON");
  auto* tune = add("tune", "brightness, saturation and blur of what the cameras see");
  auto* grab = add("grab", "one pair as PNG files");
  auto* preview = add("preview", "two JPEG files that follow the cameras, through the daemon where one runs");
  for (auto* action : {tune, grab, preview}) {
    action->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
    action->add_option("--light", verb->light, "what the projector does; without a daemon")
        ->check(CLI::IsMember({"none", "pattern", "plain"}))
        ->capture_default_str();
    action->add_option("--exposure-us", verb->exposure_us, "instead of the configuration's; without a daemon")
        ->check(CLI::Range(10, 1'000'000));
    action->add_option("--gain", verb->gain, "instead of the configuration's; without a daemon");
    action->add_flag("--json", verb->json, action == grab ? "print JSON" : "print JSON, a line a pair");
  }
  for (auto* action : {grab, preview}) {
    action->add_option("--out", verb->out, "folder for left and right")->capture_default_str();
  }
  for (auto* action : {tune, preview}) {
    action->add_option("--count", verb->count, "how many pairs; 0: until interrupted")->check(CLI::Range(0, 1'000'000));
  }
}

/// Started by the tools that move, on their socket.
void add_guardian(CLI::App& app, Chosen& chosen) {
  const auto config = std::make_shared<std::filesystem::path>();
  auto* sub = app.add_subcommand("guard-motion", "stop the table when the program that moves it ends")->group("");
  sub->add_option("CONFIG", *config, "the rig's configuration")->required();
  sub->callback([&chosen, config] { chosen = [config] { return guard_motion(*config); }; });
}

}  // namespace

void add_rig_commands(CLI::App& app, Chosen& chosen) {
  add_turntable(app, chosen);
  add_panel(app, chosen);
  add_doctor(app, chosen);
  add_camera(app, chosen);
  add_guardian(app, chosen);
}

}  // namespace scanrig::ctl
