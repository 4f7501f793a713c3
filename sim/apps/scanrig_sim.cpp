#include <CLI/CLI.hpp>
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "core/signal_stop.h"
#include "sim/apps/rig_control.h"
#include "sim/apps/rig_options.h"
#include "sim/apps/scanrig_sim_ctl.h"
#include "sim/apps/shoot.h"
#include "sim/apps/shoot_board.h"
#include "sim/apps/shoot_flats.h"
#include "sim/apps/wire_rig.h"
#include "sim/wire/control_socket.h"
#include "sim/wire/loopback.h"

namespace {

using namespace scanrig;

/// The requested verb; set while the command line is read.
using Chosen = std::function<Result<void>()>;

struct ShootVerb {
  sim::ShootOptions options;
  sim::DrawnRigOptions rig;
  sim::ProfileOptions profile;
  bool is_calibration_true = false;
  bool is_exposed_once = false;
  std::string folder;
};

/// The object on the table and the resolution of its images.
void add_scene(CLI::App& app, sim::SceneOptions& scene) {
  app.add_option("--object", scene.object,
                 "OBJ, PLY or GLB file; sphere, ball-bar, plane or step-gauge; the built-in figurine if not given");
  app.add_option("--height-mm", scene.height_mm, "Largest extent of the object")->capture_default_str();
  app.add_option("--seed", scene.seed, "Placements, noise and table errors")->capture_default_str();
  app.add_option("--scale", scene.image_scale, "Resolution, as a share of 1280x960")->capture_default_str();
  app.add_flag("--same-rest", scene.same_rest_twice, "The operator does not turn the object over");
  app.add_option("--fixture", scene.fixture, "The object leans on putty or pins in every pose")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, sim::FixtureKind>{
              {"none", sim::FixtureKind::none}, {"putty", sim::FixtureKind::putty}, {"pins", sim::FixtureKind::pins}},
          CLI::ignore_case));
  app.add_flag("--any-size", scene.any_size, "Put the object down although it is too large");
  app.add_flag("!--no-noise", scene.noise, "Leave the sensors' noise out");
}

Result<void> shoot_chosen(ShootVerb& verb) {
  const auto rig = verb.rig.variation();
  if (!rig) return pass_on(rig);
  auto profile = verb.profile.chosen();
  if (!profile) return pass_on(profile);
  if (!profile->effects.is_none() && verb.options.calibration.empty() && !verb.is_calibration_true) {
    return fail(
        ErrorCode::invalid_input,
        "shoot: a workshop has no exact calibration; give --calibration FILE, solved from images of shoot-board "
        "--profile workshop, or --true-calibration");
  }
  if (!profile->effects.is_none() && !verb.is_exposed_once) verb.options.pattern_factors = sim::kWorkshopPatternFactors;
  verb.options.scene.rig = *rig;
  verb.options.scene.profile = std::move(*profile);
  return sim::shoot(verb.options, verb.folder);
}

void add_shoot(CLI::App& app, ShootVerb& verb, Chosen& chosen) {
  auto& options = verb.options;
  auto* shoot = app.add_subcommand("shoot", "Render a whole scan, with its truth, into a folder");
  shoot->add_option("--out", verb.folder, "The scan folder to make")->required();
  add_scene(*shoot, options.scene);
  shoot->add_option("--poses", options.scene.poses, "Number of poses: how often the object is put down")
      ->capture_default_str();
  shoot->add_option("--views", options.views, "Table angles per pose")->check(CLI::Range(1, 99))->capture_default_str();
  verb.rig.add_to(*shoot);
  verb.profile.add_to(*shoot, true);
  shoot->add_flag("--spoil-all", options.scene.spoils_all, "Handling spoils every view, not one of a scan");
  shoot->add_option("--calibration", options.calibration,
                    "A calibration.json solved from the images of shoot-board with the same profile and rig");
  shoot->add_flag("--one-exposure", verb.is_exposed_once,
                  "Never a longer or shorter exposure of the pattern, which views of a workshop may want");
  shoot->add_flag("--true-calibration", verb.is_calibration_true, "The exact calibration, which no workshop has");
  shoot->callback([&] { chosen = [&] { return shoot_chosen(verb); }; });
}

void add_shoot_board(CLI::App& app, sim::ShootBoardOptions& verb, Chosen& chosen) {
  auto* shoot = app.add_subcommand(
      "shoot-board", "Render a calibration series, with its truth; see docs/reference/calibration-images.md");
  verb.add_to(*shoot);
  shoot->callback([&] {
    chosen = [&]() -> Result<void> {
      const auto options = verb.chosen();
      return options ? sim::shoot_board(*options, verb.folder) : pass_on(options);
    };
  });
}

struct FlatsVerb {
  sim::ShootFlatsOptions options;
  sim::ProfileOptions profile;
  std::string folder;
};

void add_shoot_flats(CLI::App& app, FlatsVerb& verb, Chosen& chosen) {
  auto* shoot = app.add_subcommand(
      "shoot-flats", "Render flat images of both cameras, with their truth; see docs/reference/characterisation.md");
  shoot->add_option("--out", verb.folder, "The folder to make")->required();
  shoot->add_option("--seed", verb.options.seed, "Noise, drift and flicker")->capture_default_str();
  shoot->add_option("--scale", verb.options.image_scale, "Resolution, as a share of 1280x960")->capture_default_str();
  shoot->add_option("--exposures-us", verb.options.exposures_us, "Second last: 70 % of full scale; last: saturated")
      ->delimiter(',')
      ->capture_default_str();
  shoot->add_option("--dark-pairs", verb.options.dark_pairs, "Pairs with covered lenses")->capture_default_str();
  verb.profile.add_to(*shoot, false);
  shoot->callback([&] {
    chosen = [&]() -> Result<void> {
      auto profile = verb.profile.chosen();
      if (!profile) return pass_on(profile);
      verb.options.profile = std::move(*profile);
      return sim::shoot_flats(verb.options, verb.folder);
    };
  });
}

Result<void> serve_rig(const sim::WireRigOptions& options) {
  const SignalStop stop;
  RealClock clock;
  auto rig = sim::WireRig::start(options, clock);
  if (!rig) return pass_on(rig);
  sim::RigControl control(**rig, clock);
  const auto socket = sim::wire::ControlSocket::start(options.toml.folder / "control.sock",
                                                      [&](const std::string& line) { return control.reply_to(line); });
  if (!socket) return pass_on(socket);
  const auto stopped = stop.token();
  if ((*rig)->cameras() && !(*rig)->cameras()->wait_until_ready(stopped)) return {};
  std::printf("rig ready: %s\n", (options.toml.folder / "rig.toml").c_str());
  std::fflush(stdout);
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_lock lock(mutex);
  changed.wait(lock, stopped, [] { return false; });
  return {};
}

struct RigVerb {
  sim::WireRigOptions options;
  sim::SceneOptions scene;
  sim::ProfileOptions profile;
};

Result<void> serve_chosen(RigVerb& verb) {
  sim::WireRigOptions& o = verb.options;
  auto profile = verb.profile.chosen();
  if (!profile) return pass_on(profile);
  verb.scene.poses = o.toml.poses;
  verb.scene.views = o.toml.views;
  verb.scene.profile = std::move(*profile);
  if (o.toml.cameras == "gige") o.scene = verb.scene;
  return serve_rig(o);
}

void add_rig(CLI::App& app, RigVerb& verb, Chosen& chosen) {
  sim::WireRigOptions& o = verb.options;
  auto* rig =
      app.add_subcommand("rig", "The simulated rig on the wire, until SIGTERM; see docs/reference/simulated-rig.md");
  rig->add_option("--dir", o.toml.folder, "folder for rig.toml, ports and sockets")->required();
  rig->add_option("--drive", o.toml.drive, "leadshine-rs, oriental-az, grbl")->capture_default_str();
  rig->add_option("--panel", o.toml.panel, "gpio, modbus-io")->capture_default_str();
  rig->add_option("--gear-ratio", o.toml.gear_ratio, "motor turns per table turn")->capture_default_str();
  rig->add_option("--preload-counter", o.preload_counter, "the drive's counter at the start, pulses");
  rig->add_option("--speed-deg-s", o.toml.speed_deg_s, "in rig.toml")->capture_default_str();
  rig->add_option("--acceleration-deg-s2", o.toml.acceleration_deg_s2, "in rig.toml")->capture_default_str();
  rig->add_option("--views", o.toml.views, "in rig.toml")->capture_default_str();
  rig->add_option("--poses", o.toml.poses, "in rig.toml")->capture_default_str();
  rig->add_option("--start-deg", o.axis.start_deg, "table angle at the start, from the switch")->capture_default_str();
  rig->add_option("--backlash-deg", o.axis.backlash_deg, "play of the gear")->capture_default_str();
  rig->add_option("--vibration-deg", o.axis.vibration_deg, "of the table, when a motion ends")->capture_default_str();
  rig->add_option("--voxel-mm", o.toml.voxel_mm, "in rig.toml")->capture_default_str();
  rig->add_option("--cameras", o.toml.cameras,
                  "simulated: scanrigd-sim renders; gige: two cameras on 127.0.0.1 and 127.0.0.2, see own-network")
      ->capture_default_str()
      ->check(CLI::IsMember({"simulated", "gige"}));
  rig->add_flag("--number-frames", o.numbered_frames,
                "gige: note the number of the edge in every frame's first pixels");
  rig->add_option("--max-exposure-us", o.max_exposure_us, "gige: the cameras expose no longer than this; 0: any")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000000));
  rig->add_option("--camera-state", o.camera_state,
                  "gige: seed of a state in which another program left the cameras; without it a sound one");
  add_scene(*rig, verb.scene);
  verb.profile.add_to(*rig, true);
  rig->callback([&] {
    o.axis.gear_ratio = o.toml.gear_ratio;
    o.axis.pulses_per_motor_rev = o.toml.pulses_per_motor_rev;
    chosen = [&] { return serve_chosen(verb); };
  });
}

struct ControlVerb {
  std::filesystem::path folder;
  std::vector<std::string> words;
};

Result<void> control(const ControlVerb& verb) {
  const auto reply = sim::control(verb.folder, verb.words);
  if (!reply) return pass_on(reply);
  std::printf("%s\n", reply->c_str());
  return {};
}

void add_control(CLI::App& app, ControlVerb& verb, Chosen& chosen) {
  auto* ctl = app.add_subcommand("ctl", "Send one request to a running rig: get WHAT, set KEY=VALUE..., press INPUT");
  ctl->add_option("DIR", verb.folder, "the rig's folder")->required();
  ctl->add_option("WORDS", verb.words, "get WHAT [SINCE] | set KEY=VALUE... | press|release|tap INPUT | JSON")
      ->required();
  ctl->callback([&] { chosen = [&] { return control(verb); }; });
}

void add_own_network(CLI::App& app, std::vector<std::string>& command, Chosen& chosen) {
  auto* network = app.add_subcommand(
      "own-network", "Run COMMAND in a network namespace that has 127.0.0.1 and 127.0.0.2 and nothing else");
  network->add_option("COMMAND", command, "with its arguments, after --")->required();
  network->callback([&] { chosen = [&] { return sim::wire::run_in_own_loopback(command); }; });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The simulated scanning rig");
  app.require_subcommand(1);
  Chosen chosen;
  ShootVerb shoot_verb;
  sim::ShootBoardOptions board_verb;
  FlatsVerb flats_verb;
  RigVerb rig_verb;
  rig_verb.options.toml.drive = "leadshine-rs";
  rig_verb.options.toml.panel = "gpio";
  ControlVerb control_verb;
  std::vector<std::string> command;
  add_shoot(app, shoot_verb, chosen);
  add_shoot_board(app, board_verb, chosen);
  add_shoot_flats(app, flats_verb, chosen);
  add_rig(app, rig_verb, chosen);
  add_control(app, control_verb, chosen);
  add_own_network(app, command, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "scanrig-sim: %s\n", error.what());
    return static_cast<int>(ExitCode::usage);
  }
  if (const auto done = chosen(); !done) {
    std::fprintf(stderr, "scanrig-sim: %s\n", done.error().message.c_str());
    return static_cast<int>(exit_code(done.error().code));
  }
  return 0;
}
