#include "sim/apps/rig_toml.h"

#include "core/files.h"
#include "sim/apps/rig_cameras.h"

namespace scanrig::sim {
namespace {

std::string pin(const RigTomlOptions& o, const char* line, int channel, const char* more = "") {
  return o.panel == "gpio" ? fmt::format("{{ line = \"{}\"{} }}", line, more)
                           : fmt::format("{{ channel = {} }}", channel);
}

std::string port(const RigTomlOptions& o, const char* name) {
  return fmt::format("device = \"{}\"\nbaud = 115200\n", (std::filesystem::absolute(o.folder) / name).string());
}

std::string turntable(const RigTomlOptions& o) {
  std::string text = "[turntable]\n";
  if (o.drive == "grbl") {
    text += "driver = \"grbl\"\n" + port(o, "turntable");
  } else {
    text += fmt::format("driver = \"modbus\"\nprofile = \"{}\"\n{}parity = \"none\"\nunit_id = 1\n", o.drive,
                        port(o, "turntable"));
    text += fmt::format("pulses_per_motor_rev = {:.0f}\n", o.pulses_per_motor_rev);
  }
  return text + fmt::format(
                    "reply_timeout_ms = 100\ngear_ratio = {:.4f}\npositive = \"{}\"\n"
                    "home = {{ mode = \"{}\", offset_deg = 0.0 }}\nspeed_deg_s = {}\nacceleration_deg_s2 = {}\n"
                    "backlash_deg = 0.5\ntolerance_deg = 0.02\nsettle_ms = 200\n\n",
                    o.gear_ratio, o.positive_ccw ? "ccw" : "cw", o.drive == "oriental-az" ? "absolute" : "switch",
                    o.speed_deg_s, o.acceleration_deg_s2);
}

std::string panel(const RigTomlOptions& o) {
  std::string text = fmt::format("[panel]\ndriver = \"{}\"\n", o.panel);
  if (o.panel != "gpio")
    text += port(o, "panel") + "parity = \"none\"\nunit_id = 2\nreply_timeout_ms = 100\npoll_ms = 20\n";
  const char* low = ", active = \"low\"";
  text += fmt::format("start = {}\nstop = {}\nreset = {}\npart_present = {}\nflipped = {}\n", pin(o, "START", 0, low),
                      pin(o, "STOP", 1, low), pin(o, "RESET", 2, low), pin(o, "PART_PRESENT", 5, low),
                      pin(o, "FLIPPED", 6, low));
  int coil = 0;
  for (const auto& [key, line] :
       {std::pair("lamp_red", "LAMP_RED"), std::pair("lamp_amber", "LAMP_AMBER"), std::pair("lamp_green", "LAMP_GREEN"),
        std::pair("start_lamp", "START_LAMP"), std::pair("flip_request", "FLIP"), std::pair("busy", "BUSY"),
        std::pair("pass", "PASS"), std::pair("fail", "FAIL")}) {
    text += fmt::format("{} = {}\n", key, pin(o, line, coil++));
  }
  return text + "\n";
}

std::string cameras(const RigTomlOptions& o) {
  std::string text = fmt::format("[stereo_camera]\ndriver = \"{}\"\n", o.cameras == "gige" ? "aravis" : "simulated");
  if (o.cameras != "gige") return text + "truth = \"control.sock\"\nexposure_us = 12000\n\n";
  const RigGeometry rig = default_rig();
  text += fmt::format("left = {{ serial = \"{}\", address = \"{}\" }}\n", rig.left.serial, RigCameras::kLeftAddress);
  text += fmt::format("right = {{ serial = \"{}\", address = \"{}\" }}\n", rig.right.serial, RigCameras::kRightAddress);
  return text +
         "trigger = { source = \"Line0\", edge = \"rising\" }\npixel_format = \"BayerRG8\"\nexposure_us = 12000\n"
         "packet = { size_bytes = 8192, delay_us = 0 }\nframe_timeout_ms = 500\nclock = \"interval\"\n\n";
}

std::string safety(const RigTomlOptions& o) {
  const char* low = ", active = \"low\"";
  return fmt::format("[safety]\nestop = {}\nguard = {}\nhome_after_restart = \"on_reset\"\nremote_start = false\n\n",
                     pin(o, "ESTOP_OK", 3, low), pin(o, "GUARD_OK", 4, low));
}

}  // namespace

Result<void> write_rig_toml(const RigTomlOptions& o) {
  const std::string text =
      "# The simulated rig on the wire, as scanrig-sim made it.\nschema = 1\n\n" + safety(o) + turntable(o) +
      "[projector]\ndriver = \"gpio\"\nline = \"PROJ_TRIG\"\nplain_line = \"PROJ_PLAIN\"\npulse_us = 15000\n"
      "warm_up_s = 0\n\n" +
      cameras(o) + panel(o) + "[calibration]\nfile = \"calibration.json\"\n\n" +
      fmt::format("[recipe.default]\nviews = {}\nposes = {}\nflip_timeout_min = 30\n\n", o.views, o.poses) +
      "[storage]\nroot = \"jobs\"\nreserve_gib = 1\n\n[reconstruction]\nexecutor = \"in_process\"\nmemory_gib = 6\n" +
      fmt::format("voxel_mm = {}\n\n", o.voxel_mm) + "[gpio]\nsocket = \"gpio.sock\"\n\n[api]\nsocket = \"api.sock\"\n";
  std::error_code error;
  const auto profiles = o.folder / "drives";
  if (!std::filesystem::is_symlink(profiles, error)) {
    std::filesystem::create_directory_symlink(SCANRIG_DRIVES_DIR, profiles, error);
    if (error) return fail(ErrorCode::io, "cannot create {}: {}", profiles.string(), error.message());
  }
  return write_file_atomically(o.folder / "rig.toml", text);
}

}  // namespace scanrig::sim
