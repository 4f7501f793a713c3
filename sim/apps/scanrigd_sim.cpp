#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "config/rig_config.h"
#include "core/files.h"
#include "core/virtual_clock.h"
#include "daemon/jobs/executors.h"
#include "daemon/rig/make_safe.h"
#include "daemon/rig/open_devices.h"
#include "daemon/service/service.h"
#include "sim/apps/background_camera.h"
#include "sim/apps/rig_options.h"
#include "sim/apps/simulated_operator.h"
#include "sim/apps/troubled_camera.h"
#include "sim/apps/wire_camera.h"
#include "sim/devices/sim_rig.h"
#include "sim/scene/profile.h"

namespace {

using namespace scanrig;

struct SimOptions {
  sim::SimRigOptions rig;
  sim::DrawnRigOptions drawn_rig;
  sim::ProfileOptions profile;
  std::filesystem::path socket = "out/api.sock";
  std::optional<int> http_port{};
  std::filesystem::path jobs = "out/jobs";
  int views = 8;
  double voxel_mm = 0.25;
  int threads = 0;
  std::string clock = "real";
  std::string operator_at_rig = "auto";
  double trouble = 0.0;
  bool own_calibration = false, true_calibration = false;
  bool background_cameras = false;
  std::filesystem::path config;  ///< a rig of real drivers on simulated wires
  bool make_safe = false, beside_daemon = false;
};

void add_options(CLI::App& app, SimOptions& o) {
  auto* config = app.add_option("--config", o.config,
                                "open turntable, projector and panel as in this rig.toml; its [stereo_camera] driver "
                                "may be \"simulated\"");
  app.add_flag("--make-safe", o.make_safe, "as scanrigd --make-safe")->needs(config);
  app.add_flag("--beside-daemon", o.beside_daemon, "likewise")->needs(config);
  app.add_option("--socket", o.socket, "socket of the API")->capture_default_str();
  app.add_option("--http-port", o.http_port, "serve page and API at 127.0.0.1, too; scanrig open logs in")
      ->check(CLI::Range(1024, 65535));
  app.add_option("--jobs", o.jobs, "folder of the jobs; calibration.json beside them")->capture_default_str();
  app.add_option("--object", o.rig.object, "mesh to scan (OBJ, PLY, GLB); default: the built-in figurine");
  app.add_option("--height-mm", o.rig.height_mm, "height the object is scaled to")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--seed", o.rig.seed, "placements, sensor noise, table errors")->capture_default_str();
  o.drawn_rig.add_to(app);
  o.profile.add_to(app, true);
  app.add_flag("--true-calibration", o.true_calibration, "of a workshop: the exact calibration, which no workshop has");
  app.add_flag("--own-calibration", o.own_calibration,
               "the rig knows only the calibration that it made: calibration.json beside the jobs, if it is there");
  app.add_option("--views", o.views, "views per pose")->capture_default_str()->check(CLI::Range(1, 360));
  app.add_option("--scale", o.rig.image_scale, "of the images: 0.25 gives 320x240")
      ->capture_default_str()
      ->check(CLI::Range(sim::kSmallestImageScale, sim::kLargestImageScale));
  app.add_flag("!--no-noise", o.rig.noise, "leave the sensors' noise out");
  app.add_flag("--same-rest", o.rig.same_rest_twice, "the operator does not turn the object over");
  app.add_option("--voxel-mm", o.voxel_mm, "size of a voxel")->capture_default_str()->check(CLI::Range(0.05, 10.0));
  app.add_option("--threads", o.threads, "of the reconstruction; 0: all")->check(CLI::Range(0, 1024));
  app.add_option("--clock", o.clock, "real, or virtual: no waiting for the rig")
      ->capture_default_str()
      ->check(CLI::IsMember({"real", "virtual"}));
  app.add_flag("--background-cameras", o.background_cameras,
               "images are rendered with low priority, for a page on the same machine: real cameras take no time of "
               "its processor");
  app.add_option("--operator", o.operator_at_rig,
                 "auto: an operator scans one object; helper: an operator turns objects over, fixes faults and presses "
                 "Reset, the API does the rest; none: the API does all")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "helper", "none"}));
  app.add_option("--trouble", o.trouble,
                 "share of the exposures before which a frame is lost, the camera stops sending, the table is blocked, "
                 "the guard is opened or the e-stop is pressed")
      ->check(CLI::Range(0.0, 1.0));
}

/// A simulated image takes as long as its rendering: that is no camera that hangs.
constexpr auto kRenderingMargin = std::chrono::minutes(2);

/// What rig.toml says of board and table in a real rig.
CalibratorOptions calibrator_of(const sim::SimRig& rig, const JobStoreOptions& jobs) {
  CalibrateOptions options;
  const auto [length_mm, sigma_mm] = rig.measured_board_length();
  options.length = first_row_length(Board{}, length_mm, sigma_mm);
  const auto& profile = sim::profile();
  constexpr int kRimDots = 40;
  options.rim_dots = RimDots{kRimDots, profile.rim_dot_radius_mm, profile.rim_dot_diameter_mm};
  options.table_radius_mm = profile.table_radius_mm;
  return {.cameras = jobs.cameras, .solver = calibration_solver(options, jobs.calibration_file)};
}

/// The exact one, of the default rig. A drawn rig, a workshop, and one with --own-calibration, has to be calibrated
/// first.
Result<void> write_calibration(const SimOptions& o, const sim::SimRig& rig, const std::filesystem::path& file) {
  const bool is_workshop = !o.rig.profile.effects.is_none();
  if (o.rig.rig || o.own_calibration || (is_workshop && !o.true_calibration)) return {};
  return rig.write_calibration(file);
}

/// Checks that the rig can take the object before anything is written.
Result<void> run(SimOptions o, const SignalStop& stop) {
  auto drawn = o.drawn_rig.variation();
  if (!drawn) return pass_on(drawn);
  o.rig.rig = *drawn;
  auto profile = o.profile.chosen();
  if (!profile) return pass_on(profile);
  o.rig.profile = std::move(*profile);
  o.rig.views = o.views;
  std::unique_ptr<Clock> clock;
  if (o.clock == "virtual") {
    clock = std::make_unique<VirtualClock>();
  } else {
    clock = std::make_unique<RealClock>();
  }
  auto rig = sim::SimRig::create(o.rig, *clock);
  if (!rig) return pass_on(rig);
  sim::SimRig& r = **rig;

  if (auto made = create_directories_synced(o.jobs); !made) return made;
  const auto calibration = o.jobs / "calibration.json";
  if (auto written = write_calibration(o, r, calibration); !written) return written;

  ReconstructOptions reconstruct;
  reconstruct.voxel_mm = o.voxel_mm;
  reconstruct.threads = o.threads;
  DaemonOptions options;
  const auto cameras = r.camera_serials();
  options.jobs = {.root = o.jobs,
                  .calibration_file = calibration,
                  .cameras = {cameras[0], cameras[1]},
                  .profile = r.profile_sha256()};
  options.calibrator = calibrator_of(r, options.jobs);
  options.recipes["default"] = {.poses = o.rig.poses, .views = o.views};
  options.api.socket = o.socket;
  options.api.http_port = o.http_port;
  options.api.logins = o.socket.parent_path() / "logins.json";
  options.remote = options.guard = true;  // a simulated table cannot hurt a person
  options.reconstructor = pipeline_reconstructor(reconstruct);
  options.hang_margin = kRenderingMargin;
  if (!o.rig.profile.effects.is_none()) options.acquisition.pattern_factors = sim::kWorkshopPatternFactors;
  options.on_scanned = [&r](const std::filesystem::path& folder) { return r.write_truth(folder); };

  std::optional<sim::Operator> operator_thread;
  using Role = sim::Operator::Role;
  if (o.operator_at_rig != "none")
    operator_thread.emplace(r, *clock, o.operator_at_rig == "auto" ? Role::alone : Role::helper);
  options.published = [&operator_thread](const std::shared_ptr<const Snapshot>& snapshot) {
    const auto& awaited = snapshot->awaited_placement;
    const auto job = snapshot->jobs.find(snapshot->job);
    const bool calibrates = awaited || (job != snapshot->jobs.end() && job->second->recipe.is_calibration());
    if (operator_thread) operator_thread->read_screen(awaited ? awaited->placement + 1 : 0, calibrates);
  };
  sim::TroubledCamera camera(r, o.trouble, o.rig.seed);
  sim::BackgroundCamera background(camera);
  StereoCamera& used = o.background_cameras ? static_cast<StereoCamera&>(background) : camera;
  Journal journal(standard_sink());
  options.journal = [&journal](JournalEntry entry) { journal.write(std::move(entry)); };
  const auto ended = run_daemon({r.turntable(), r.projector(), used, r.panel()}, options, *clock, stop.token());
  return ended ? Result<void>() : pass_on(ended);
}

/// The shipped drivers on the wires of the configuration, with rendered images where it selects them.
Result<Ended> run_on_wires(const SimOptions& o, const config::RigConfig& config, DaemonOptions options,
                           const SignalStop& stop) {
  RealClock clock;
  options.stop_table_outside = [&o] { return make_safe_in_process("/proc/self/exe", o.config); };
  auto open = open_devices(config, clock);
  if (!open) return pass_on(open, o.config.string());
  if (config.stereo_camera.driver != config::StereoCameraConfig::Driver::simulated) {
    return run_daemon(open->devices(), options, clock, stop.token());
  }
  options.hang_margin = kRenderingMargin;
  const auto profile = o.profile.chosen();
  if (!profile) return pass_on(profile);
  auto scene = sim::Scene::create({.object = o.rig.object,
                                   .height_mm = o.rig.height_mm,
                                   .seed = o.rig.seed,
                                   .poses = options.recipes.at("default").poses,
                                   .image_scale = o.rig.image_scale,
                                   .same_rest_twice = o.rig.same_rest_twice,
                                   .noise = o.rig.noise,
                                   .profile = *profile,
                                   .views = options.recipes.at("default").views});
  if (!scene) return pass_on(scene);
  if (auto made = create_directories_synced(config.calibration_file.parent_path()); !made) return pass_on(made);
  if (profile->effects.is_none() || o.true_calibration) {
    if (auto written = sim::write_calibration(**scene, config.calibration_file); !written) return pass_on(written);
  }
  options.jobs.profile = profile->sha256();
  options.jobs.cameras = {(*scene)->rig().left.serial, (*scene)->rig().right.serial};
  sim::WireCamera camera(std::move(*scene), config.stereo_camera.truth, clock);
  options.on_scanned = [&camera](const std::filesystem::path& folder) { return camera.write_truth(folder); };
  sim::WatchedProjector projector(*open->projector, camera);
  sim::WatchedPanel panel(*open->panel, camera);
  return run_daemon({*open->turntable, projector, camera, panel}, options, clock, stop.token());
}

Result<void> run_as_told(const SimOptions& o, SignalStop& stop) {
  if (o.config.empty()) return run(o, stop);
  Service service("scanrigd-sim", o.config, config::Cameras::or_simulated);
  return service.run(stop, [&](const config::RigConfig& config, const DaemonOptions& options) {
    return run_on_wires(o, config, options, stop);
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "scanrigd-sim: the daemon over a simulated rig in the same process. Exit codes: docs/reference/exit-codes.md");
  SimOptions options;
  add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "scanrigd-sim: {}\n", error.what());
    return static_cast<int>(ExitCode::usage);
  }
  if (options.make_safe)
    return static_cast<int>(
        make_safe_now(options.config, "scanrigd-sim", options.beside_daemon ? Beside::hung_daemon : Beside::nobody));
  SignalStop stop(options.config.empty() ? SignalStop::Hangup::ends : SignalStop::Hangup::is_told);
  const auto done = run_as_told(options, stop);
  if (done) return static_cast<int>(ExitCode::ok);
  fmt::print(stderr, "scanrigd-sim: {}\n", done.error().message);
  return static_cast<int>(exit_code(done.error().code));
}
