#include "daemon/ctl/commands.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/ctl/motion_guardian.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig::ctl {

void add_board_options(CLI::App& sub, BoardOptions& board, bool& is_named) {
  const auto names_it = [&is_named](const auto&) { is_named = true; };
  sub.add_option("--board", board.squares, "squares of the board")->capture_default_str()->each(names_it);
  sub.add_option("--square-mm", board.square_mm, "side of a square")->capture_default_str()->each(names_it);
  sub.add_option("--marker-mm", board.marker_mm, "side of a marker")->capture_default_str()->each(names_it);
  sub.add_option("--dictionary", board.dictionary, "OpenCV's markers")->capture_default_str()->each(names_it);
  sub.add_option("--thickness-mm", board.thickness_mm, "of the board")->capture_default_str()->each(names_it);
  sub.add_flag_callback(
      "--chessboard", [&board, &is_named] { board.chessboard = is_named = true; }, "a board without markers");
}

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

/// Images of a folder instead of the rig.
void add_calibrate_folder(CLI::App& sub, CalibrateFolderVerb& verb) {
  auto* folder = sub.add_option("DIR", verb.images, "make calibration.json of the images in this folder");
  for (const char* rig : {"--rig", "--check", "--accept", "--abort"}) folder->excludes(sub.get_option(rig));
  sub.add_option("--compare", verb.check, "DIR: does this calibration still hold? Writes --out where the poses changed")
      ->needs(folder);
  sub.add_option("--out", verb.out, "DIR: the file to write; one that is there is kept under another name")
      ->capture_default_str();
  add_board_options(sub, verb.board, verb.has_board);
  sub.add_flag("--paper", verb.paper, "DIR: the board is printed on paper");
  sub.add_option("--length", verb.length_mm, "DIR: first to last corner of a row as measured, mm, and its uncertainty")
      ->expected(2);
  sub.add_option("--second-length", verb.second_length_mm, "DIR: the same with another instrument, compared only")
      ->expected(2);
  sub.add_option("--report", verb.report, "DIR: the report to write (default: beside --out, as .html)");
  sub.add_flag("!--no-report", verb.with_report, "DIR: write no report")->excludes(sub.get_option("--report"));
  sub.add_option("--rim-dots", verb.rim_dots, "DIR: printed on the table's rim: COUNTxRADIUSxDIAMETER, mm");
  sub.add_option("--rim-points", verb.rim_dots)->group("");  // old name
  sub.add_option("--focal-px", verb.options.focal_px, "DIR: focal length, within 10 %")->check(CLI::PositiveNumber);
  sub.add_option("--pixel-format", verb.options.pixel_format, "DIR: of images without a list")
      ->check(CLI::IsMember({"Mono8", "BayerRG8", "BGR8"}));
  sub.add_option("--threads", verb.options.threads, "DIR: threads; 0: all of the machine's")
      ->check(CLI::Range(0, 1024));
}

void add_calibrate(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<CalibrateVerb>();
  const auto folder = std::make_shared<CalibrateFolderVerb>();
  auto* sub = add_client(app, chosen, "calibrate", "calibrate the rig, or from a folder of images", verb,
                         [folder](const Connection& connection, const CalibrateVerb& rig) {
                           if (folder->images.empty()) return calibrate(connection, rig);
                           folder->json = connection.json;
                           return calibrate_folder(*folder);
                         });
  auto* rig = sub->add_flag("--rig", verb->rig, "begin, or take up the one begun, and follow it to its end");
  auto* check = sub->add_flag("--check", verb->check, "does the calibration still hold? One placement, one minute");
  check->excludes(rig);
  auto* accept = sub->add_flag("--accept", verb->accept, "use what was solved last; the old file is kept");
  accept->excludes(rig)->excludes(check);
  sub->add_flag("--abort", verb->abort, "cancel it; an active one is stopped")
      ->excludes(rig)
      ->excludes(check)
      ->excludes(accept);
  add_calibrate_folder(*sub, *folder);
}

}  // namespace

void add_station_commands(CLI::App& app, Chosen& chosen) {
  const auto look = std::make_shared<StatusVerb>();
  auto* sub = add_client(app, chosen, "status", "what the rig does, why, and what to do next", look, status);
  auto* follow = sub->add_flag("--follow", look->follow, "follow the active job, or the next one, to its end");
  sub->add_flag("--watch", look->watch, "one screen, kept up to date until interrupted")->excludes(follow);
  const auto begin = std::make_shared<StartVerb>();
  add_client(app, chosen, "start", "start a scan; after the flip: continue", begin, start)
      ->add_flag("--follow", begin->follow, "follow the job to its end");
  const auto halt = std::make_shared<StopVerb>();
  add_client(app, chosen, "stop", "stop the table, in every state, and wait until it has stopped", halt, stop)
      ->add_flag("!--no-wait", halt->wait, "do not wait for standstill");
  const auto page = std::make_shared<OpenVerb>();
  auto* open =
      add_client(app, chosen, "open", "the page's address, with a code that logs a browser in", page, open_page);
  open->add_option("--role", page->role, "that the browser gets, at most one's own")
      ->capture_default_str()
      ->check(CLI::IsMember({"viewer", "operator", "engineer"}));
  open->add_flag("--kiosk", page->kiosk, "show it on this screen, over all of it; the login does not end by itself");
  open->add_option("--browser", page->browser, "kiosk: the program")->capture_default_str();
  add_button(app, chosen, "reset", "clear a fault and home the table");
  add_button(app, chosen, "reload",
             "restart the service with the configuration file as it is now, while the rig is idle");
  add_client(app, chosen, "health", "devices, disk, temperatures, deadlines missed, retakes", std::make_shared<int>(),
             [](const Connection& connection, int) { return health(connection); });
  add_maintenance(app, chosen);
  add_calibrate(app, chosen);
}

namespace {

CLI::Option* add_id(CLI::App* sub, std::string& id) { return sub->add_option("ID", id, "the job"); }

template <class Verb>
CLI::App* add_change(CLI::App& app, Chosen& chosen, const char* name, const char* description,
                     const std::shared_ptr<Verb>& verb) {
  verb->what = name;
  auto* sub = add_client(app, chosen, name, description, verb, change_job);
  add_id(sub, verb->id)->required();
  return sub;
}

void add_changes(CLI::App& app, Chosen& chosen) {
  const auto verb = [] { return std::make_shared<JobVerb>(); };
  add_change(app, chosen, "cancel", "end a job that is queued, interrupted or being reconstructed", verb());
  add_change(app, chosen, "resume", "let the next Start go on with an interrupted job", verb());
  add_change(app, chosen, "first", "let the next Start begin this queued job", verb());
  const auto again = verb();
  auto* sub = add_change(app, chosen, "reprocess", "make the model again, from the images", again);
  sub->add_option("--voxel-mm", again->voxel_mm, "size of a voxel")->check(CLI::Range(kMinVoxelMm, kMaxVoxelMm));
  sub->add_option("--fusion", again->fusion, "how poses are integrated")->check(CLI::IsMember({"evidence", "paper"}));
  const auto removed = verb();
  add_change(app, chosen, "delete", "remove a job that has ended, with all its files", removed)
      ->add_flag("--yes", removed->yes, "do not prompt");
}

}  // namespace

void add_job_commands(CLI::App& app, Chosen& chosen) {
  const auto list = std::make_shared<JobsVerb>();
  auto* sub = add_client(app, chosen, "jobs", "all jobs, newest first, or one in detail", list, jobs);
  add_id(sub, list->id);
  sub->add_option("--limit", list->limit, "this many at most")->capture_default_str()->check(CLI::Range(1, 100000));
  sub->add_option("--state", list->state, "only jobs in this state")
      ->check(CLI::IsMember(
          {"queued", "scanning", "waiting_for_flip", "reconstructing", "done", "failed", "interrupted", "cancelled"}));
  auto* pick = sub->add_subcommand("choose", "ID choose N: which of the ways in which pose 2 fits is right");
  pick->add_option("N", list->choice, "as `scanrig jobs ID` numbers them")->required()->check(CLI::Range(1, 1000));
  auto* more = sub->add_subcommand("add-pose", "ID add-pose: the next Start scans another pose of this finished job");
  more->callback([list] { list->add_pose = true; });
  for (auto* change : {pick, more}) change->fallthrough();  // --socket and --json may stand behind it
  const auto order = std::make_shared<QueueVerb>();
  sub = add_client(app, chosen, "queue", "queue scans and print the first one's id", order, queue);
  sub->add_option("--recipe", order->recipe, "one of the configuration's")->capture_default_str();
  sub->add_option("--part", order->part, "of what is scanned: barcode or free text");
  sub->add_option("--repeat", order->repeat, "so many jobs")->capture_default_str()->check(CLI::Range(1, 100));
  add_changes(app, chosen);
  const auto files = std::make_shared<std::string>();
  add_id(add_client(app, chosen, "files", "the files of a job", files, job_files), *files)->required();
  const auto out = std::make_shared<ExportVerb>();
  sub = add_client(app, chosen, "export", "copy a file of a job, by default its model, from the service", out,
                   export_file);
  add_id(sub, out->id)->required();
  sub->add_option("--file", out->file, "which, as `scanrig files` names it")->capture_default_str();
  sub->add_option("--out", out->out, "new file to write (default: ID-FILE in the current folder)");
  const auto pack = std::make_shared<BundleVerb>();
  sub = add_client(app, chosen, "bundle", "pack a job into one archive to send to support", pack, bundle);
  add_id(sub, pack->id)->required();
  sub->add_option("--out", pack->out, "new archive to write (default: ID.tar.gz in the current folder)");
}

namespace {

void add_turntable(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<TurntableVerb>();
  auto* sub = app.add_subcommand("turntable", "move or query the turntable itself, while no service runs");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = add_action(*sub, chosen, name, description, verb, &turntable);
    action->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
    return action;
  };
  auto* home = add("home", "find home");
  auto* move = add("move", "find home, then turn to ANGLE, the shorter way");
  move->add_option("ANGLE", verb->angle_deg, "degrees, counter-clockwise")->required();
  for (auto* action : {home, move})
    action->add_flag("--yes", verb->yes, "do not prompt first: you have checked that no person is near the rig");
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

void add_projector(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<ProjectorVerb>();
  auto* sub = app.add_subcommand("projector", "a LightCrafter's firmware, while no service runs");
  const CLI::IsMember known({"info", "load"});
  sub->add_option("WHAT", verb->what, "info, or load: write FILE into its flash")->required()->check(known);
  sub->add_option("FILE", verb->file, "load: firmware with the pattern's images, made with TI's control software");
  sub->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
  sub->add_flag("--yes", verb->yes, "load: without a question");
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return projector(*verb); }; });
}

void add_doctor(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<DoctorVerb>();
  auto* sub = app.add_subcommand("doctor", "try everything the configuration names and tell what is wrong");
  sub->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
  sub->add_flag("--allow-motion", verb->yes_move, "the table may turn: everyone is clear");
  sub->add_flag("--interactive", verb->answers, "replies come on standard input although it is no terminal");
  sub->add_option("--machine-root", verb->machine_root)->group("");  // tests only
  sub->add_flag("--yes-move", verb->yes_move)->group("");            // old name
  sub->add_flag("--answers", verb->answers)->group("");              // old name
  sub->add_flag("--page", verb->page)->group("");                    // for the service only
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return examine_rig(*verb); }; });
}

void add_setup(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<SetupVerb>();
  auto* sub =
      app.add_subcommand("setup", "find what is connected, prompt for the rest, write rig.toml, run the doctor");
  sub->add_option("--out", verb->options.out, "the configuration to write")->capture_default_str();
  sub->add_option("--state", verb->options.state, "folder of jobs, calibration and tokens")->capture_default_str();
  sub->add_option("--port", verb->options.ports, "a serial port besides the USB adapters; may be repeated");
  sub->add_option("--gpio-socket", verb->options.gpio_socket, "GPIO lines behind a socket instead of chips, for tests");
  sub->add_option("--http-port", verb->options.http_port, "port of the page on this machine; 0: none")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  sub->add_flag("--interactive", verb->answers, "replies come on standard input although it is no terminal");
  sub->add_flag("--page", verb->page)->group("");  // for the service only, as the next two
  sub->add_option("--present", verb->options.present)->group("");
  sub->add_option("--images", verb->options.images)->group("");
  sub->callback([&chosen, verb] { chosen = [verb] { return set_up(*verb); }; });
}

void add_camera(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<CameraVerb>();
  auto* sub = app.add_subcommand("camera", "the cameras themselves");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = add_action(*sub, chosen, name, description, verb, &camera);
    return action;
  };
  add("list", "every camera on network, USB and V4L2, with its serial number")
      ->add_flag("--json", verb->json, "print JSON");
  auto* tune = add("tune", "brightness, saturation and blur of what the cameras see");
  auto* grab = add("grab", "one pair as PNG files");
  auto* preview = add("preview", "two JPEG files that follow the cameras, through the service where one runs");
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

void add_characterise(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<CharacteriseVerb>();
  auto* sub = app.get_subcommand("camera")->add_subcommand(
      "characterise", "gain, noise, black level and hot pixels from images of a sheet of paper");
  auto* from = sub->add_option("--from", verb->from, "folder of flat images; else they are taken at the rig");
  sub->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
  sub->add_option("--out", verb->out, "the file to write (default: characterisation.json beside the calibration)");
  sub->add_option("--images", verb->images, "at the rig: new folder for the images")
      ->capture_default_str()
      ->excludes(from);
  sub->add_option("--light", verb->light, "at the rig: what the projector does")
      ->check(CLI::IsMember({"none", "plain"}))
      ->capture_default_str();
  sub->add_option("--gain", verb->gain, "at the rig: instead of the configuration's")->excludes(from);
  sub->add_option("--gamma", verb->gamma, "with which the camera codes its values, as 0.45")
      ->check(CLI::Range(0.2, 1.0))
      ->capture_default_str();
  sub->add_flag("--interactive", verb->answers, "replies come on standard input although it is no terminal");
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return characterise_cameras(*verb); }; });
}

/// Started by the tools that move the table, on their socket.
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
  add_setup(app, chosen);
  add_projector(app, chosen);
  add_doctor(app, chosen);
  add_camera(app, chosen);
  add_characterise(app, chosen);
  add_guardian(app, chosen);
}

}  // namespace scanrig::ctl
