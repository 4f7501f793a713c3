#include "config/rig_config.h"

#include <algorithm>
#include <cstdio>
#include <tuple>
#include <utility>

#include "config/camera_section.h"
#include "config/drive_profile_file.h"
#include "config/pin.h"
#include "config/projector_section.h"
#include "config/section.h"
#include "config/turntable_section.h"
#include "core/files.h"
#include "core/max_poses.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig::config {
namespace {

/// The panel's driver watches e-stop and guard.
void read_safety(Section& s, const PanelConfig& panel, SafetyConfig& safety) {
  using Home = SafetyConfig::HomeAfterRestart;
  const Wiring wiring = panel.driver == PanelConfig::Driver::modbus_io ? Wiring::channel : Wiring::gpio_input;
  safety.estop = read_pin(s, "estop", wiring);
  if (s.has("guard")) safety.guard = read_pin(s, "guard", wiring);
  s.choice<Home>("home_after_restart", safety.home_after_restart,
                 {{"on_reset", Home::on_reset}, {"guarded", Home::guarded}});
  s.flag("remote_start", safety.remote_start);
  std::map<std::string, Pin> contacts{{"estop", safety.estop}};
  if (safety.guard) contacts["guard"] = *safety.guard;
  if (s.sound()) report_shared(s, contacts, panel.inputs);
  if (safety.guard) return;
  if (safety.remote_start) s.report("remote_start", "true needs a guard");
  if (safety.home_after_restart == Home::guarded) s.report("home_after_restart", "\"guarded\" needs a guard");
}

void read_panel(Section& s, PanelConfig& panel) {
  using Driver = PanelConfig::Driver;
  s.choice<Driver>("driver", panel.driver, {{"gpio", Driver::gpio}, {"modbus-io", Driver::modbus_io}});
  const bool by_channel = panel.driver == Driver::modbus_io;
  if (by_channel) {
    read_modbus_line(s, panel.io_module);
    s.number("poll_ms", panel.poll, {5, 200});
  }
  const Wiring input = by_channel ? Wiring::channel : Wiring::gpio_input;
  const Wiring output = by_channel ? Wiring::channel : Wiring::gpio_output;
  panel.inputs["start"] = read_pin(s, "start", input);
  for (const char* key : {"stop", "reset", "part_present", "flipped"}) {
    if (s.has(key)) panel.inputs[key] = read_pin(s, key, input);
  }
  for (const char* key :
       {"lamp_red", "lamp_amber", "lamp_green", "start_lamp", "flip_request", "busy", "pass", "fail"}) {
    if (s.has(key)) panel.outputs[key] = read_pin(s, key, output);
  }
  if (!s.sound()) return;
  report_shared(s, panel.inputs, {});
  report_shared(s, panel.outputs, {});
}

/// Without these no job could start, or a fault would not be noticed.
void check_can_operate(Section& s, const PanelConfig& panel) {
  if (!panel.inputs.contains("reset")) {
    s.report("reset", "missing: the table is homed, and a fault cleared, by Reset only; name its input");
  }
  if (!panel.outputs.contains("lamp_red")) {
    s.report("lamp_red", "missing: a fault would not be visible at the rig; name the output of the red lamp");
  }
}

void read_limits(Section& s, RecipeConfig& recipe) {
  s.accept_old_name("min_measured_share", "least_measured_share");
  s.accept_old_name("max_residual_mm", "most_residual_mm");
  if (s.has("min_measured_share")) {
    s.number("min_measured_share", recipe.min_measured_share.emplace(), {0, 1});
  }
  if (s.has("max_residual_mm")) s.number("max_residual_mm", recipe.max_residual_mm.emplace(), {0.001, 10});
}

/// A start by signal needs no person. No person may be able to reach the table then.
void expect_guard(Section& s, const RigConfig& rig, std::string_view key, std::string_view value) {
  if (!rig.safety.guard) s.report(key, fmt::format("\"{}\" needs a guard in [safety]", value));
}

void read_recipe(Section& s, const RigConfig& rig, RecipeConfig& recipe) {
  using Flip = RecipeConfig::Flip;
  using Start = RecipeConfig::Start;
  s.number("views", recipe.views, {3, 72});
  s.number("poses", recipe.poses, {1, kMaxPoses});
  s.number("flip_timeout_min", recipe.flip_timeout, {1, 1440});
  s.accept_old_value("flip", "signal", "line");
  if (s.has("flip")) s.choice<Flip>("flip", recipe.flip, {{"button", Flip::button}, {"signal", Flip::signal}});
  if (s.has("start")) {
    s.choice<Start>("start", recipe.start, {{"button", Start::button}, {"part_present", Start::part_present}});
  }
  if (s.has("fixture")) s.flag("fixture", recipe.fixture);
  if (s.has("limits")) s.section("limits", [&](Section& limits) { read_limits(limits, recipe); });
  if (recipe.flip == Flip::signal) {
    if (!rig.panel.inputs.contains("flipped")) s.report("flip", "\"signal\" needs the input flipped in [panel]");
    expect_guard(s, rig, "flip", "signal");
  }
  if (recipe.start == Start::part_present) {
    if (!rig.panel.inputs.contains("part_present")) {
      s.report("start", "\"part_present\" needs the input part_present in [panel]");
    }
    expect_guard(s, rig, "start", "part_present");
  }
}

void read_recipes(Section& s, RigConfig& rig) {
  const auto read = [&](const std::string& name) {
    auto& recipe = rig.recipes[name];
    s.section(name, [&](Section& r) { read_recipe(r, rig, recipe); });
  };
  read("default");
  for (const std::string& name : s.free_keys()) {
    if (name != "default") read(name);
  }
}

void read_storage(Section& s, const std::filesystem::path& base, StorageConfig& storage) {
  s.path("root", base, storage.root);
  s.number("reserve_gib", storage.reserve_gib, {0, 100'000});
  if (s.has("keep_days")) s.number("keep_days", storage.keep_days.emplace(), {1, 36'500});
  if (s.has("keep_gib")) s.number("keep_gib", storage.keep_gib.emplace(), {1, 1'000'000});
}

/// "22:30"
void read_time_of_day(Section& s, std::string_view key, std::chrono::minutes& time) {
  std::string text;
  s.text(key, text);
  int hour = -1, minute = -1, end = 0;
  const bool read = std::sscanf(text.c_str(), "%2d:%2d%n", &hour, &minute, &end) == 2;
  if (!read || end != static_cast<int>(text.size()) || hour < 0 || hour > 23 || minute < 0 || minute > 59) {
    return s.report(key, fmt::format("\"{}\" is no time of day such as \"22:30\"", text));
  }
  time = std::chrono::hours(hour) + std::chrono::minutes(minute);
}

void read_board(Section& s, Board& board, BoardKind& kind) {
  BoardMarkers markers;
  s.number("columns", board.columns, {3, 100});
  s.number("rows", board.rows, {3, 100});
  s.number("square_mm", board.square_mm, {1, 200});
  s.number("marker_mm", markers.size_mm, {0.5, 200});
  s.text("dictionary", markers.dictionary);
  s.number("thickness_mm", board.thickness_mm, {0, 100});
  if (s.has("material"))
    s.choice<BoardKind>("material", kind, {{"glass", BoardKind::glass}, {"paper", BoardKind::paper}});
  board.markers = markers;
  if (const auto can_be = check_board(board); !can_be) s.report("columns", can_be.error().message);
}

void read_calibration(Section& s, CalibrationConfig& calibration) {
  if (s.has("board"))
    s.section("board", [&](Section& board) { read_board(board, calibration.board, calibration.board_kind); });
  if (s.has("table_radius_mm")) s.number("table_radius_mm", calibration.table_radius_mm, {10, 1000});
  if (s.has("rim_dots")) {
    s.section("rim_dots", [&](Section& dots) {
      RimDots& printed = calibration.rim_dots.emplace();
      dots.number("count", printed.count, {8, 360});
      dots.number("radius_mm", printed.radius_mm, {10, 1000});
      dots.number("diameter_mm", printed.diameter_mm, {0.5, 20});
    });
  }
  if (s.has("length_mm")) {
    const double nominal = calibration.board.square_mm * (calibration.board.corner_columns() - 1);
    s.number("length_mm", calibration.length_mm.emplace(), {0.97 * nominal, 1.03 * nominal});
    s.number("length_sigma_mm", calibration.length_sigma_mm, {0.0001, 1});
  } else if (s.has("length_sigma_mm")) {
    s.report("length_sigma_mm", "needs length_mm");
  }
  if (s.has("check_every_h")) s.number("check_every_h", calibration.check_every, {1, 87'600});
  if (s.has("accept")) {
    s.choice<bool>("accept", calibration.accepts_by_itself, {{"asked", false}, {"automatic", true}});
  }
}

void read_webhook(Section& s, WebhookConfig& webhook) {
  std::string url;
  s.text("url", url);
  constexpr std::string_view kScheme = "http://";
  const auto rest = url.starts_with(kScheme) ? url.substr(kScheme.size()) : std::string();
  const auto slash = std::min(rest.find('/'), rest.size());
  const auto place = rest.substr(0, slash);
  const auto colon = std::min(place.rfind(':'), place.size());
  webhook.host = place.substr(0, colon);
  webhook.port = colon == place.size() ? "80" : place.substr(colon + 1);
  webhook.path = slash == rest.size() ? "/" : rest.substr(slash);
  const bool number = !webhook.port.empty() && webhook.port.find_first_not_of("0123456789") == std::string::npos;
  if (webhook.host.empty() || !number) s.report("url", fmt::format("\"{}\" is no http://HOST:PORT/PATH", url));
}

void read_slurm(Section& s, bool is_used, const std::filesystem::path& base, SlurmConfig& slurm) {
  using Fallback = SlurmConfig::Fallback;
  const auto has = [&](const char* key) {
    const bool found = s.has(key);
    if (found && !is_used) s.report(key, "needs executor = \"slurm\"");
    return found;
  };
  if (has("slurm_partition")) s.text("slurm_partition", slurm.partition);
  if (has("slurm_options")) {
    s.items("slurm_options", [&](std::optional<std::int64_t> number, std::string_view word) {
      if (number || !word.starts_with('-')) s.report("slurm_options", "holds options of sbatch, such as \"--qos=low\"");
      slurm.options.emplace_back(word);
    });
  }
  if (has("slurm_program")) s.path("slurm_program", base, slurm.program);
  if (has("slurm_stage")) s.path("slurm_stage", base, slurm.stage);
  if (has("slurm_commands")) s.path("slurm_commands", base, slurm.commands);
  if (has("slurm_cores")) s.number("slurm_cores", slurm.cores, {1, 1024});
  if (has("slurm_resubmits")) s.number("slurm_resubmits", slurm.resubmits, {0, 100});
  if (has("slurm_fallback")) {
    s.choice<Fallback>("slurm_fallback", slurm.fallback, {{"local", Fallback::local}, {"wait", Fallback::wait}});
  }
  if (has("slurm_wait_min")) s.number("slurm_wait_min", slurm.wait, {1, 10080});
}

void read_reconstruction(Section& s, const std::filesystem::path& base, ReconstructionConfig& reconstruction) {
  using Executor = ReconstructionConfig::Executor;
  s.choice<Executor>(
      "executor", reconstruction.executor,
      {{"in_process", Executor::in_process}, {"process", Executor::process}, {"slurm", Executor::slurm}});
  s.number("memory_gib", reconstruction.memory_gib, {1, 1024});
  s.number("voxel_mm", reconstruction.voxel_mm, {kMinVoxelMm, kMaxVoxelMm});
  s.accept_old_name("timeout_min", "limit_min");
  if (s.has("timeout_min")) s.number("timeout_min", reconstruction.timeout, {1, 1440});
  read_slurm(s, reconstruction.executor == Executor::slurm, base, reconstruction.slurm);
}

bool is_loopback(std::string_view address) { return address.starts_with("127.") || address == "::1"; }

bool is_origin(std::string_view text) {
  const auto name = text.find("://");
  return (text.starts_with("https://") || text.starts_with("http://")) && name + 3 < text.size() &&
         text.find('/', name + 3) == std::string_view::npos;
}

void read_api(Section& s, const std::filesystem::path& base, ApiConfig& api) {
  s.path("socket", base, api.socket);
  if (s.has("tokens")) s.path("tokens", base, api.tokens);
  if (s.has("http_port")) {
    s.number("http_port", api.http_port.emplace(), {1024, 65535});
    if (api.tokens.empty()) s.report("http_port", "needs tokens, the file that scanrig token add writes");
  }
  if (s.has("http_address")) {
    s.text("http_address", api.http_address);
    if (!api.http_port) s.report("http_address", "needs http_port");
  }
  if (s.has("proxy")) {
    s.text("proxy", api.proxy);
    if (!api.http_port && !api.proxy.starts_with("unix:")) s.report("proxy", "needs http_port, or \"unix:USER\"");
  }
  if (s.has("http_origin")) {
    s.text("http_origin", api.http_origin);
    if (!is_origin(api.http_origin)) s.report("http_origin", "is like https://rig.example, without a path");
  }
  if (s.has("insecure_http")) s.flag("insecure_http", api.insecure_http);
  if (!is_loopback(api.http_address) && api.proxy.empty() && !api.insecure_http) {
    s.report(
        "http_address",
        "other machines would send tokens in the clear: name the proxy that speaks TLS, or say insecure_http = true");
  }
  if (s.has("viewer_group")) s.text("viewer_group", api.viewer_group.emplace());
  if (s.has("operator_group")) s.text("operator_group", api.operator_group.emplace());
  if (s.has("engineer_group")) s.text("engineer_group", api.engineer_group.emplace());
}

void read_gpio(Section& root, const std::filesystem::path& base, RigConfig& rig) {
  if (!root.has("gpio")) return;
  root.section("gpio", [&](Section& s) { s.path("socket", base, rig.gpio_socket.emplace()); });
}

void read_safety(Section& root, RigConfig& rig) {
  root.section("safety", [&](Section& s) { read_safety(s, rig.panel, rig.safety); });
}

/// The panel's I/O module may drive the projector, too.
void read_module_of_projector(Section& root, ProjectorConfig& projector) {
  if (projector.driver != ProjectorConfig::Driver::modbus_io) return;
  root.section("panel", [&](Section& s) {
    for (const auto& key : s.free_keys()) std::ignore = s.has(key);  // not checked here
    read_modbus_line(s, projector.io_module);
  });
}

/// The left camera makes them outputs when it is connected.
std::vector<std::string> strobe_outputs(const ProjectorConfig& projector) {
  if (projector.driver != ProjectorConfig::Driver::camera_strobe || !projector.plain_line) return {};
  return {projector.line.line, projector.plain_line->line};
}

void read_rig(Section& root, const std::filesystem::path& base, const std::vector<std::filesystem::path>& drives,
              Cameras cameras, RigConfig& rig) {
  int schema = 0;
  root.one_of("schema", schema, {1});
  root.section("turntable", [&](Section& s) { read_turntable(s, drives, rig.turntable); });
  root.section("stereo_camera", [&](Section& s) { read_stereo_camera(s, base, cameras, rig.stereo_camera); });
  root.section("panel", [&](Section& s) {
    read_panel(s, rig.panel);
    check_can_operate(s, rig.panel);
  });
  read_safety(root, rig);
  root.section("projector", [&](Section& s) {
    read_projector(s, rig.stereo_camera.longest_exposure(), rig.projector);
    check_projector(s, rig);
  });
  rig.projector.io_module = rig.panel.io_module;
  rig.stereo_camera.aravis.strobe_outputs = strobe_outputs(rig.projector);
  root.section("calibration", [&](Section& s) {
    s.path("file", base, rig.calibration_file);
    read_calibration(s, rig.calibration);
  });
  root.section("recipe", [&](Section& s) { read_recipes(s, rig); });
  root.section("storage", [&](Section& s) { read_storage(s, base, rig.storage); });
  root.section("reconstruction", [&](Section& s) { read_reconstruction(s, base, rig.reconstruction); });
  if (root.has("quiet_hours")) {
    root.section("quiet_hours", [&](Section& s) {
      read_time_of_day(s, "from", rig.quiet_hours.emplace().from);
      read_time_of_day(s, "to", rig.quiet_hours->to);
    });
  }
  if (root.has("webhook")) {
    root.section("webhook", [&](Section& s) { read_webhook(s, rig.webhook.emplace()); });
  }
  read_gpio(root, base, rig);
  root.section("api", [&](Section& s) { read_api(s, base, rig.api); });
}

std::vector<std::filesystem::path> usual_drives(const std::filesystem::path& file) {
  const auto base = file.parent_path();
  return {base / "drives", base / ".." / "drives", "/usr/share/scanrig/drives"};
}

}  // namespace

Result<RigConfig> read_rig_config(const std::filesystem::path& file, const std::filesystem::path& drives,
                                  Cameras cameras) {
  const std::vector<std::filesystem::path> folders = drives.empty() ? usual_drives(file) : std::vector{drives};
  auto text = read_file(file);
  if (!text) return pass_on(text);
  RigConfig rig;
  rig.text = std::move(*text);
  const auto read =
      read_toml(rig.text, file, [&](Section& root) { read_rig(root, file.parent_path(), folders, cameras, rig); });
  if (!read) return pass_on(read);
  rig.warnings = *read;
  return rig;
}

Result<std::map<std::string, DriveProfile>> read_drive_profiles(const std::filesystem::path& file) {
  for (const auto& folder : usual_drives(file)) {
    std::map<std::string, DriveProfile> profiles;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() != ".toml") continue;
      auto profile = read_drive_profile(entry->path());
      if (!profile) return pass_on(profile);
      profiles.emplace(entry->path().stem().string(), *std::move(profile));
    }
    if (!profiles.empty()) return profiles;
  }
  return fail(ErrorCode::not_found,
              "there are no drive profiles in drives/ beside {}, nor in /usr/share/scanrig/drives", file.string());
}

Result<RigConfig> read_device_config(SafetyDevice device, const std::filesystem::path& file,
                                     const std::filesystem::path& base) {
  auto text = read_file(file);
  if (!text) return pass_on(text);
  RigConfig rig;
  rig.text = std::move(*text);
  const auto read = read_toml(rig.text, file, [&](Section& root) {
    for (const auto& key : root.free_keys()) std::ignore = root.has(key);  // known, or not checked here
    switch (device) {
      case SafetyDevice::turntable:
        return root.section("turntable", [&](Section& s) { read_turntable(s, usual_drives(file), rig.turntable); });
      case SafetyDevice::projector:
        root.section("projector", [&](Section& s) { read_projector(s, {}, rig.projector); });
        read_module_of_projector(root, rig.projector);
        return read_gpio(root, base, rig);
      case SafetyDevice::panel:
        root.section("panel", [&](Section& s) { read_panel(s, rig.panel); });
        read_safety(root, rig);
        return read_gpio(root, base, rig);
    }
  });
  if (!read) return pass_on(read);
  return rig;
}

}  // namespace scanrig::config
