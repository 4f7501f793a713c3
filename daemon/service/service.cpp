#include "daemon/service/service.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/hash.h"
#include "core/version.h"
#include "daemon/api/socket_file.h"
#include "daemon/jobs/executors.h"
#include "daemon/rig/make_safe.h"
#include "daemon/rig/open_devices.h"
#include "daemon/service/crash_report.h"
#include "pipeline/reconstruct/memory.h"

namespace scanrig {
namespace {

/// For setup's program to end, and another process to stop the table.
constexpr auto kMakeSafeLimit = std::chrono::seconds(5);

std::uintmax_t gib(double count) { return static_cast<std::uintmax_t>(count * (1u << 30)); }

/// V4L2 devices named by their path have no identity; two sensors in one device have one number.
CameraSerials cameras_from(const config::StereoCameraConfig& config) {
  const auto [left, right] = config.serials();
  return {left, right};
}

Recipe recipe_from(const std::string& name, const config::RecipeConfig& config) {
  return {.name = name,
          .poses = config.poses,
          .views = config.views,
          .flip_timeout = config.flip_timeout,
          .flip_by_signal = config.flip == config::RecipeConfig::Flip::signal,
          .start_on_part = config.start == config::RecipeConfig::Start::part_present,
          .fixture = config.fixture,
          .limits = {config.min_measured_share, config.max_residual_mm}};
}

SlurmExecutorOptions slurm_options_from(const config::SlurmConfig& config, ProcessExecutorOptions local) {
  using Fallback = SlurmExecutorOptions::Fallback;
  return {.commands = config.commands,
          .partition = config.partition,
          .options = config.options,
          .program = config.program,
          .stage = config.stage,
          .cores = config.cores,
          .resubmits = config.resubmits,
          .fallback = config.fallback == config::SlurmConfig::Fallback::local ? Fallback::local : Fallback::wait,
          .away_limit = config.wait,
          .local = std::move(local)};
}

ReconstructorFactory reconstructor_from(const config::ReconstructionConfig& config) {
  using Executor = config::ReconstructionConfig::Executor;
  if (config.executor != Executor::in_process) {
    ProcessExecutorOptions local{
        .program = {}, .limit = config.timeout, .memory_bytes = gib(config.memory_gib), .voxel_mm = config.voxel_mm};
    const auto outside = config.executor == Executor::slurm
                             ? slurm_reconstructor(slurm_options_from(config.slurm, std::move(local)))
                             : process_reconstructor(std::move(local));
    return [=](const ReconstructionTask& task) -> Result<std::unique_ptr<Reconstructor>> {
      const auto voxel_mm = task.changes.voxel_mm.value_or(config.voxel_mm);
      auto fits = check_memory(task.calibration, task.views, voxel_mm, gib(config.memory_gib));
      if (!fits) return pass_on(fits);
      return outside(task);
    };
  }
  ReconstructOptions options;
  options.voxel_mm = config.voxel_mm;
  return pipeline_reconstructor(options, gib(config.memory_gib));
}

CalibrateOptions calibrate_options_from(const config::RigConfig& rig) {
  const config::CalibrationConfig& config = rig.calibration;
  CalibrateOptions options;
  options.board = config.board;
  options.board_kind = config.board_kind;
  if (config.length_mm) options.length = first_row_length(config.board, *config.length_mm, config.length_sigma_mm);
  options.rim_dots = config.rim_dots;
  options.table_radius_mm = config.table_radius_mm;
  options.gear_ratio = rig.turntable.motion().scale.gear_ratio;
  return options;
}

/// True if a sleep of this machine would lose something now.
bool is_job_active(const Snapshot& snapshot) {
  const bool scans = !snapshot.job.empty() || snapshot.machine == MachineState::single_execution ||
                     snapshot.machine == MachineState::continuous_execution;
  return scans || std::ranges::any_of(snapshot.jobs,
                                      [](const auto& job) { return job.second->state == JobState::reconstructing; });
}

}  // namespace

DaemonOptions options_from(const config::RigConfig& config) {
  DaemonOptions options;
  options.jobs = {.root = config.storage.root,
                  .calibration_file = config.calibration_file,
                  .cameras = cameras_from(config.stereo_camera),
                  .profile = "",
                  .config_sha256 = sha256(config.text),
                  .reserve_bytes = gib(config.storage.reserve_gib),
                  .check_calibration_every = config.calibration.check_every};
  options.calibrator = {.board = config.calibration.board,
                        .cameras = options.jobs.cameras,
                        .solver = calibration_solver(calibrate_options_from(config), config.calibration_file)};
  options.accepts_calibrations = config.calibration.accepts_by_itself;
  options.state_folder = crash_folder(config.storage.root).parent_path();
  options.recipes.clear();
  for (const auto& [name, recipe] : config.recipes) options.recipes[name] = recipe_from(name, recipe);
  options.retention.keep_for = config.storage.keep_days;
  if (config.storage.keep_gib) options.retention.keep_bytes = gib(*config.storage.keep_gib);
  options.bundle.rig_texts["rig.toml"] = config.text;
  if (const auto& profile = config.turntable.profile_file) options.bundle.rig_texts[profile->name] = profile->text;
  options.bundle.crash_folder = crash_folder(config.storage.root);
  if (config.quiet_hours) options.quiet_hours = QuietHours{config.quiet_hours->from, config.quiet_hours->to};
  options.warm_up = config.projector.warm_up;
  options.acquisition.pattern_factors = config.stereo_camera.pattern_factors();
  options.api = {.socket = config.api.socket,
                 .groups = {config.api.viewer_group, config.api.operator_group, config.api.engineer_group},
                 .http_port = config.api.http_port,
                 .http_address = config.api.http_address,
                 .tokens = config.api.tokens,
                 .logins = config.api.tokens.empty() ? "" : config.api.tokens.parent_path() / "logins.json",
                 .http_origin = config.api.http_origin,
                 .insecure_http = config.api.insecure_http,
                 .proxy = config.api.proxy};
  if (config.webhook) options.webhook = HttpAddress{config.webhook->host, config.webhook->port, config.webhook->path};
  options.remote = config.safety.remote_start;
  options.guard = config.safety.guard.has_value();
  options.auto_home = config.safety.home_after_restart == config::SafetyConfig::HomeAfterRestart::guarded;
  options.manual_light = config.projector.driver == config::ProjectorConfig::Driver::manual;
  options.panel_read_time = panel_read_time(config.panel);
  options.reconstructor = reconstructor_from(config.reconstruction);
  return options;
}

Result<void> Service::run(SignalStop& stop, const Run& run) {
  auto config = read();
  if (!config) return pass_on(config);
  report_crashes_to(crash_folder(config->storage.root));
  journal_.emplace(standard_sink());
  stop_ = stop.token();
  awake_.emplace([this](const std::string& problem) { tell(Priority::warning, problem); });
  stop.on_hangup([this] { reload([](const auto&) {}); });
  auto ended = run_again_and_again(run, std::move(*config));
  stop.on_hangup({});
  setup_.reset();
  awake_.reset();
  tell(Priority::notice, name_ + " ends.");
  journal_.reset();
  return ended;
}

Result<void> Service::run_again_and_again(const Run& run, config::RigConfig config) {
  std::optional<config::RigConfig> before;
  bool lent = false;
  for (bool again = false;; again = true) {
    if (again) manager_.begins_again();
    tell_begin(config);
    if (!lent) make_setup(config);
    begun_ = false;
    const auto options = options_for(config, again);
    const auto ended = lent ? run_lent(options) : run(config, options);
    if (ended && *ended == Ended::reload) {
      const std::lock_guard guard(mutex_);
      if (next_) before = std::exchange(config, std::move(*next_));
      next_.reset();
      lent = std::exchange(lends_next_, false);
    } else if (!ended && !begun_ && std::exchange(lent, false)) {
      tell(Priority::error, fmt::format("No setup: {}", ended.error().message));
      setup_->end();
    } else if (!ended && !begun_ && before) {
      tell(Priority::error, fmt::format("New configuration failed, old one restored: {}", ended.error().message));
      config = std::move(*before);
      before.reset();
    } else {
      return ended ? Result<void>() : pass_on(ended);
    }
  }
}

DaemonOptions Service::options_for(const config::RigConfig& config, bool again) {
  auto options = options_from(config);
  if (again) options.auto_home = false;  // a person at the rig restarts; a reload needs no person there
  options.takes_devices = [this, &config] { return save_config(config, saved_config_folder(file_)); };
  options.api.passed_socket = sockets_.local;
  options.api.passed_tcp = sockets_.tcp;
  options.api.check_config = [this] {
    const auto checked = read();
    return checked ? Result<void>() : pass_on(checked);
  };
  options.api.reload = [this](ControlLoop::Reply reply) { reload(std::move(reply)); };
  options.api.setup = setup_;
  options.api.begin_setup = [this](const std::string& who, ControlLoop::Reply reply) {
    begin_setup(who, std::move(reply));
  };
  options.api.end_setup = [this](ControlLoop::Reply reply) { end_setup(std::move(reply)); };
  options.on_loop = [this](ControlLoop& loop) {
    const std::lock_guard guard(mutex_);
    loop_ = &loop;
    reloading_ = false;
  };
  options.loop_ends = [this] {
    const std::lock_guard guard(mutex_);
    loop_ = nullptr;
  };
  options.on_exit_hang = [this](const Error& why) {
    fmt::print(stderr, "{}: the rig was stopped, but {}: forced exit.\n", name_, why.message);
    std::_Exit(static_cast<int>(exit_code(why.code)));
  };
  options.alive = [this](const std::string& sentence) {
    begun_ = true;
    manager_.alive(sentence);
  };
  options.published = [this](const std::shared_ptr<const Snapshot>& snapshot) {
    awake_->keep_awake(is_job_active(*snapshot));
  };
  options.journal = [this](JournalEntry entry) { journal_->write(std::move(entry)); };
  return options;
}

/// Its program finds the devices of this machine and asks also where the present configuration has one.
void Service::make_setup(const config::RigConfig& config) {
  if (cameras_ != config::Cameras::real) return;
  const auto program = std::filesystem::read_symlink("/proc/self/exe").replace_filename("scanrig").string();
  auto file = std::filesystem::absolute(file_), draft = file;
  draft += ".found";
  const auto state = crash_folder(config.storage.root).parent_path();
  std::vector<std::string> setup{program,
                                 "setup",
                                 "--page",
                                 "--out",
                                 draft.string(),
                                 "--present",
                                 file.string(),
                                 "--state",
                                 config.storage.root.parent_path().string(),
                                 "--images",
                                 (state / "setup").string()};
  std::vector<std::string> ports{config.turntable.device()};
  if (config.panel.driver == config::PanelConfig::Driver::modbus_io) ports.push_back(config.panel.io_module.device);
  for (auto& port : ports) setup.insert(setup.end(), {"--port", std::move(port)});
  if (config.gpio_socket) setup.insert(setup.end(), {"--gpio-socket", config.gpio_socket->string()});
  const auto check = [](const std::filesystem::path& found) -> Result<void> {
    const auto read = config::read_rig_config(found);
    return read ? Result<void>() : pass_on(read);
  };
  setup_ = std::make_shared<config::setup::Session>(
      config::setup::SessionOptions{.setup = std::move(setup),
                                    .doctor = {program, "doctor", "--page", "--config", file.string()},
                                    .file = file,
                                    .draft = draft,
                                    .check = check});
  setup_->on_silence([this] {
    tell(Priority::warning, "Setup's browser is gone: the service takes its devices back.");
    end_setup([](const auto&) {});
  });
}

void Service::begin_setup(const std::string& who, ControlLoop::Reply reply) {
  const auto key = setup_->claim(who);
  if (!key) return reply(key);
  restart_for_setup(event::ReloadRequested::Why::lend,
                    [this, who, key = *key, reply = std::move(reply)](const Result<std::string>& taken) {
                      if (!taken) {
                        setup_->end();
                        return reply(taken);
                      }
                      tell(Priority::notice, fmt::format("{} begins setup: the service closes its devices.", who));
                      reply(key);
                    });
}

/// Called for any end: by a person, by Stop, by a browser that is gone.
void Service::end_setup(ControlLoop::Reply reply) {
  restart_for_setup(event::ReloadRequested::Why::give_back,
                    [this, reply = std::move(reply)](const Result<std::string>& taken) {
                      if (taken) tell(Priority::notice, "Setup has ended: the service opens its devices.");
                      reply(taken);
                    });
}

/// A changed file that cannot be used changes nothing.
void Service::restart_for_setup(event::ReloadRequested::Why why, ControlLoop::Reply reply) {
  const bool lends = why == event::ReloadRequested::Why::lend;
  auto config = lends ? fail(ErrorCode::refused, "") : read();
  if (!lends && !config) tell(Priority::error, "The configuration stays as it was: " + config.error().message);
  std::unique_lock guard(mutex_);
  if (!loop_ || std::exchange(reloading_, true)) {
    guard.unlock();  // the reply may end the session, whose thread may wait here
    return reply(fail(ErrorCode::busy, "The service is already starting, ending or reloading."));
  }
  lends_next_ = lends;
  next_.reset();
  if (config) next_ = std::move(*config);
  loop_->ask(event::ReloadRequested{.why = why}, [this, reply = std::move(reply)](const Result<std::string>& taken) {
    if (taken) {
      manager_.reloading();
      return reply(taken);
    }
    {
      const std::lock_guard again(mutex_);
      lends_next_ = reloading_ = false;
      next_.reset();
    }
    reply(taken);
  });
}

Result<Ended> Service::run_lent(DaemonOptions options) {
  RealClock clock;
  LentDevices devices([this]() -> Result<void> {
    if (setup_->end()) end_setup([](const auto&) {});  // by Stop: then the devices are not needed any more
    return make_safe_in_process("/proc/self/exe", file_);
  });
  options.lent = true;
  options.hang_margin = kMakeSafeLimit;
  options.on_loop = [this, on_loop = std::move(options.on_loop)](ControlLoop& loop) {
    on_loop(loop);
    if (auto begun = setup_->begin(); !begun) {
      tell(Priority::error, as_sentence(begun.error().message));
      end_setup([](const auto&) {});
    }
  };
  return run_daemon(devices.devices(), options, clock, stop_);
}

void Service::tell_begin(const config::RigConfig& config) {
  tell(Priority::notice, fmt::format("{} {} begins.", name_, kVersion));
  for (const auto& warning : config.warnings) tell(Priority::warning, warning);
  if (!sockets_.local) return;
  const auto there = socket_path(*sockets_.local);
  if (there == config.api.socket) return;
  tell(Priority::warning, fmt::format("The API's socket is {}, as systemd was told, not {}, as the configuration says.",
                                      there.string(), config.api.socket.string()));
}

void Service::reload(ControlLoop::Reply reply) {
  {
    const std::lock_guard guard(mutex_);
    if (!loop_ || std::exchange(reloading_, true)) {
      const Error why{ErrorCode::busy, "The service is already starting, ending or reloading."};
      tell(Priority::warning, "No reload: " + why.message);
      return reply(tl::unexpected(why));
    }
  }
  manager_.reloading();
  auto config = read();
  if (!config) return give_up(config.error(), reply);
  const std::lock_guard guard(mutex_);
  next_ = std::move(*config);
  if (!loop_) return;  // the daemon has ended: no client waits for a reply
  loop_->ask(event::ReloadRequested{}, [this, reply = std::move(reply)](const Result<std::string>& taken) {
    if (!taken) return give_up(taken.error(), reply);
    tell(Priority::notice, "The new configuration is valid: the service restarts with it.");
    reply(taken);
  });
}

void Service::give_up(const Error& why, const ControlLoop::Reply& reply) {
  auto sentence = "Reload refused, configuration unchanged: " + why.message;
  std::ranges::replace(sentence, '\n', ' ');  // one line per problem; a status is one line
  {
    const std::lock_guard guard(mutex_);
    next_.reset();
    reloading_ = false;
  }
  manager_.stays(sentence);
  tell(Priority::warning, sentence);
  reply(tl::unexpected(why));
}

}  // namespace scanrig
