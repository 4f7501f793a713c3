#include <CLI/CLI.hpp>
#include <functional>

#include "daemon/ctl/verbs.h"

namespace {

using namespace scanrig;
using namespace scanrig::ctl;

/// The verb that was asked for; set while the command line is read.
using Chosen = std::function<ExitCode()>;

struct ClientVerb {
  Connection connection{.socket = "/run/scanrig/api.sock"};
  bool follow = false;
  std::string job;
  MaintenanceVerb maintenance;
};

void add_client_verbs(CLI::App& app, ClientVerb& verb, Chosen& chosen) {
  const auto add = [&](const char* name, const char* about, Chosen run) {
    auto* sub = app.add_subcommand(name, about);
    sub->add_option("--socket", verb.connection.socket, "the daemon's socket")->envname("SCANRIG_SOCKET");
    sub->add_flag("--json", verb.connection.json, "print JSON");
    sub->callback([&chosen, run = std::move(run)] { chosen = run; });
    return sub;
  };
  add("status", "what the station does, why, and what to do next", [&] {
    return status(verb.connection, verb.follow);
  })->add_flag("--follow", verb.follow, "follow the job that has the rig, or the next one, to its end");
  add("start", "start a scan; after the flip: continue", [&] {
    return start(verb.connection, verb.follow);
  })->add_flag("--follow", verb.follow, "follow the job to its end");
  add("stop", "stop the table and cancel the scan", [&] { return press(verb.connection, "stop"); });
  add("reset", "clear a fault and home the table", [&] { return press(verb.connection, "reset"); });
  auto* maintain = add("maintenance", "home, jog and try the rig while no job can run",
                       [&] { return maintenance(verb.connection, verb.maintenance); });
  maintain->add_option("WHAT", verb.maintenance.what, "on, off, or what to do while it is on")
      ->required()
      ->check(CLI::IsMember({"on", "off", "home", "jog", "pulse", "lamp_test", "io"}));
  maintain->add_option("--to", verb.maintenance.to_deg, "jog: to this angle");
  maintain->add_option("--by", verb.maintenance.by_deg, "jog: by this much");
  maintain->add_option("--speed", verb.maintenance.speed_deg_s, "jog: deg/s")->capture_default_str();
  add("jobs", "all jobs, or one in detail", [&] {
    return jobs(verb.connection, verb.job);
  })->add_option("ID", verb.job, "the job");
}

void add_reconstruct(CLI::App& app, ReconstructVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("reconstruct", "make the model of a scan folder");
  sub->add_option("DIR", verb.scan, "the scan folder")->required();
  sub->add_option("--out", verb.out, "folder for the model, not there yet (default: DIR/model)");
  sub->add_option("--threads", verb.options.threads, "threads; 0: all of the machine's")->check(CLI::Range(0, 1024));
  sub->add_option("--voxel-mm", verb.options.voxel_mm,
                  "size of a voxel (default: 0.25, or what suits imported range images)")
      ->check(CLI::Range(0.05, 10.0));
  sub->add_option("--fusion", verb.options.fusion, "how poses are integrated")
      ->check(CLI::IsMember({"evidence", "paper"}));
  sub->add_option("--rests", verb.options.rests, "how rests are found")->check(CLI::IsMember({"hull", "egi"}));
  sub->add_flag("!--no-texture", verb.options.texture, "shape only");
  sub->add_flag("--lines", verb.lines, "tell the progress in lines for a program");
  sub->callback([&] { chosen = [&] { return reconstruct(verb); }; });
}

void add_evaluate(CLI::App& app, EvaluateVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("evaluate", "compare a model with the truth of a simulated scan");
  sub->add_option("DIR", verb.scan, "the scan folder, with truth.json")->required();
  sub->add_option("--model", verb.model, "the model's folder (default: DIR/model)");
  sub->add_flag("--json", verb.json, "print JSON");
  sub->callback([&] { chosen = [&] { return evaluate(verb); }; });
}

void add_import(CLI::App& app, ImportVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("import", "make a scan folder from other people's data");
  sub->require_subcommand(1);
  auto* stanford = sub->add_subcommand("stanford", "range scans of the Stanford repository");
  stanford->add_option("--pose", verb.conf, "the .conf file of a pose; once or twice")
      ->required()
      ->expected(1)
      ->take_all();
  stanford->add_option("--out", verb.out, "the scan folder to make")->required();
  stanford->callback([&] { chosen = [&] { return import_stanford(verb); }; });
}

void add_check_config(CLI::App& app, CheckConfigVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("check-config", "read a rig.toml and tell everything that is wrong with it");
  sub->add_option("FILE", verb.file, "the configuration")->required();
  sub->add_option("--drives", verb.drives, "folder of the drive profiles");
  sub->callback([&] { chosen = [&] { return check_config(verb); }; });
}

void add_turntable(CLI::App& app, TurntableVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("turntable", "move or ask the turntable itself, while no daemon runs");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* about) {
    auto* action = sub->add_subcommand(name, about);
    action->add_option("--config", verb.config, "the rig's configuration")->capture_default_str();
    action->callback([&verb, &chosen, name] {
      verb.what = name;
      chosen = [&verb] { return turntable(verb); };
    });
    return action;
  };
  auto* home = add("home", "find home");
  auto* move = add("move", "find home, then turn to ANGLE, the shorter way");
  move->add_option("ANGLE", verb.angle_deg, "degrees, counter-clockwise")->required();
  for (auto* action : {home, move}) action->add_flag("--yes", verb.yes, "nobody is near: do not ask");
  auto* status = add("status", "moving, home, alarm");
  auto* read = add("read", "what the drive's registers say");
  for (auto* action : {status, read}) action->add_flag("--json", verb.json, "print JSON");
}

void add_panel(CLI::App& app, PanelVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("panel", "the panel itself, while no daemon runs");
  sub->require_subcommand(1);
  auto* watch = sub->add_subcommand("watch", "print buttons and contacts as they change");
  watch->add_option("--config", verb.config, "the rig's configuration")->capture_default_str();
  watch->add_option("--seconds", verb.seconds, "how long; 0: until interrupted")->check(CLI::Range(0, 86400));
  watch->callback([&] { chosen = [&] { return watch_panel(verb); }; });
}

void add_camera(CLI::App& app, CameraVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("camera", "the cameras themselves");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* about) {
    auto* action = sub->add_subcommand(name, about);
    action->callback([&verb, &chosen, name] {
      verb.what = name;
      chosen = [&verb] { return camera(verb); };
    });
    return action;
  };
  add("list", "every camera on network, USB and V4L2, with its serial number")
      ->add_flag("--json", verb.json, "print JSON");
  auto* tune = add("tune", "brightness, saturation and blur of what the cameras see");
  auto* grab = add("grab", "one pair as PNG files");
  auto* preview = add("preview", "two JPEG files that follow the cameras, through the daemon where one runs");
  for (auto* action : {tune, grab, preview}) {
    action->add_option("--config", verb.config, "the rig's configuration")->capture_default_str();
    action->add_option("--light", verb.light, "what the projector does; without a daemon")
        ->check(CLI::IsMember({"none", "pattern", "plain"}))
        ->capture_default_str();
    action->add_option("--exposure-us", verb.exposure_us, "instead of the configuration's; without a daemon")
        ->check(CLI::Range(10, 1'000'000));
    action->add_option("--gain", verb.gain, "instead of the configuration's; without a daemon");
  }
  for (auto* action : {grab, preview}) {
    action->add_option("--out", verb.out, "folder for left and right")->capture_default_str();
  }
  for (auto* action : {tune, preview}) {
    action->add_option("--count", verb.count, "how many pairs; 0: until interrupted")->check(CLI::Range(0, 1'000'000));
  }
}

void add_doctor(CLI::App& app, DoctorVerb& verb, Chosen& chosen) {
  auto* sub = app.add_subcommand("doctor", "try everything the configuration names and tell what is wrong");
  sub->add_option("--config", verb.config, "the rig's configuration")->capture_default_str();
  sub->add_flag("--yes-move", verb.yes_move, "the table may turn: nobody is near it");
  sub->add_flag("--answers", verb.answers, "somebody answers on standard input although it is no terminal");
  sub->add_flag("--json", verb.json, "print JSON");
  sub->callback([&] { chosen = [&] { return examine_rig(verb); }; });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("scanrig: the operator's and engineer's command. Exit codes: docs/exit-codes.md");
  app.require_subcommand(1);
  Chosen chosen;
  ClientVerb client_verb;
  ReconstructVerb reconstruct_verb;
  EvaluateVerb evaluate_verb;
  ImportVerb import_verb;
  CheckConfigVerb check_config_verb;
  add_client_verbs(app, client_verb, chosen);
  add_reconstruct(app, reconstruct_verb, chosen);
  add_evaluate(app, evaluate_verb, chosen);
  add_import(app, import_verb, chosen);
  add_check_config(app, check_config_verb, chosen);
  TurntableVerb turntable_verb;
  PanelVerb panel_verb;
  DoctorVerb doctor_verb;
  CameraVerb camera_verb;
  add_turntable(app, turntable_verb, chosen);
  add_panel(app, panel_verb, chosen);
  add_camera(app, camera_verb, chosen);
  add_doctor(app, doctor_verb, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return static_cast<int>(complain(ExitCode::usage, error.what()));
  }
  return static_cast<int>(chosen());
}
