#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "config/rig_config.h"
#include "config/setup/dialogue.h"
#include "core/clock.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/projector/projector.h"

namespace scanrig::ctl::doctor {

/// A problem in one sentence, and its remedy in another.
struct Finding {
  std::string id;  ///< one word for programs: "gear_ratio"
  std::string problem;
  std::string remedy;
};

/// Results of the doctor, section by section, and its findings.
class Report {
 public:
  void section(std::string heading) { sections_.push_back({std::move(heading), {}}); }
  void note(std::string line) { sections_.back().lines.push_back(std::move(line)); }
  void find(std::string id, std::string problem, std::string remedy) {
    findings_.push_back({std::move(id), std::move(problem), std::move(remedy)});
  }
  [[nodiscard]] const std::vector<Finding>& findings() const { return findings_; }

  [[nodiscard]] std::string text() const;
  [[nodiscard]] std::string json() const;  ///< with the time of the report

 private:
  struct Section {
    std::string heading;
    std::vector<std::string> lines;
  };
  std::vector<Section> sections_;
  std::vector<Finding> findings_;
};

/// The person at the rig, at a terminal or at the other end of standard input.
class Operator {
 public:
  /// `page`: the service is at the other end, for a person at the page. Then all is lines of setup::to_line().
  enum class Face { terminal, page };

  /// `interactive`: a person replies on standard input although it is no terminal. Prompts go to standard error with
  /// `quiet_output`, so that standard output stays JSON.
  Operator(bool interactive, bool quiet_output, Face face = Face::terminal);

  [[nodiscard]] bool there() const { return there_; }
  /// True for a person who may let the table turn: a browser can be anywhere.
  [[nodiscard]] bool is_at_rig() const { return there_ && face_ == Face::terminal; }
  [[nodiscard]] Face face() const { return face_; }
  void tell(const std::string& text) const;
  /// The line that was entered; nothing without a person there.
  [[nodiscard]] std::optional<std::string> prompt(const std::string& question) const;
  [[nodiscard]] std::optional<std::string> prompt(const config::setup::Question& question) const;

 private:
  void print(const std::string& line) const;
  [[nodiscard]] std::optional<std::string> reply() const;

  bool there_;
  bool quiet_output_;
  Face face_;
};

/// The rig to be examined, and the file that a motion's guardian reads again.
struct Rig {
  const config::RigConfig& config;
  const std::filesystem::path& file;
  std::filesystem::path machine_root{};  ///< /proc and /sys are read below it; empty: those of this machine
};

/// The last images of a trial in each light, and how bright each side was. `off`: by software, the projector dark.
struct TrialImages {
  bool has_cameras = false;         ///< both cameras, with the serial numbers that the configuration names
  StereoFrame off, pattern, plain;  ///< empty images: none was taken
  /// Brightness left and right of every image in pattern light [0] and in plain light [1], in order.
  std::array<std::pair<std::vector<double>, std::vector<double>>, 2> brightness;

  void keep(Light light, StereoFrame frame);
};

/// Examines everything that the configuration names, in the order of daemon/ctl/doctor/README.md. Without `may_turn` a
/// person is prompted before the table turns. Fails with what made examine_cameras() or examine_motion() fail.
Result<void> examine_rig(const Rig& rig, bool may_turn, const Operator& person, Clock& clock, Report& report);

/// Checks whether the drive responds at its port as configured, how fast, and reads its registers. Otherwise finds what
/// responds there instead (`wrong_parity`, `wrong_baud`, `wrong_unit_id`, `swapped_adapter`, `no_answer`, ...).
/// Returns whether the drive can be used.
bool examine_drive(const config::RigConfig& rig, Clock& clock, Report& report);

/// Turns the table under the rules of with_motion(). Homes, then a quarter turn for the sign (the operator enters its
/// direction), then one revolution from home switch to home switch for the gear ratio. Findings: `cannot_turn`,
/// `reversed_sign`, `gear_ratio`. Fails with `stopped` (on request) and `refused` (e-stop, guard): examination ends.
Result<void> examine_motion(const Rig& rig, const Operator& person, Clock& clock, Report& report);

/// Checks that lamps can be lit and inputs read. With a person there, checks whether the e-stop's input follows the
/// button and whether the drive loses its power. Findings: `panel`, `estop_not_wired`, `estop_keeps_power`.
/// Returns whether the table may be turned: no finding against the emergency stop.
bool examine_panel(const config::RigConfig& rig, bool drive_answers, const Operator& person, Clock& clock,
                   Report& report);

/// Connects and sets up the cameras, which are not simulated ones, exposes both by the projector every 0.4 s for 20 s
/// and counts pairs, lost frames and torn ones. The light is off at every end. Findings: `slow_link`, `camera_missing`,
/// `camera_settings`, `no_trigger`, `frames_lost`, `packets_lost`, `receive_buffer`, `projector`. Returns the images
/// taken. Fails with `stopped`.
Result<TrialImages> examine_cameras(const Rig& rig, const std::stop_token& stop, Clock& clock, Report& report);

/// Judges the light and the lenses by a trial's images. Findings: `light_stays_on`, `room_light`, `no_light`,
/// `dark_camera`, `no_pattern`, `no_plain_light`, `overexposed`, `light_unstable`, `lights_exchanged`, `same_image`,
/// `focus_difference`. Returns whether the pattern images can be matched.
bool judge_images(const TrialImages& images, Report& report);

/// Checks the calibration: there, of these cameras if they are connected, not too old. With `may_match` compares it
/// with the pattern images: in which order do they fit, and do their rows. Findings: `no_calibration`,
/// `other_calibration`, `calibration_old`, `clock_behind`, `cameras_swapped`, `calibration_fits_badly`,
/// `calibration_moved`.
void examine_calibration(const Rig& rig, const TrialImages& images, bool may_match, Report& report);

/// Checks the job folder: may it be written, how fast, is there space; and whether a time server sets the clock.
/// Findings: `folder_not_writable`, `slow_disk`, `disk_full`.
void examine_machine(const Rig& rig, Clock& clock, Report& report);

/// Lists serial adapters, GPIO chips with their named lines, USB devices and the groups of the user.
void list_what_is_connected(Report& report);

/// Checks whether this user may open `device` for reading and writing. If not, a finding gives the reason: no such
/// device, or the missing group (`device_missing`, `missing_group`).
bool may_open(const std::filesystem::path& device, const std::string& section, Report& report);

/// The udev rule that gives the adapter behind `device` the name the configuration uses, and the systemd unit, where
/// this machine has none yet.
void print_missing_snippets(const std::filesystem::path& device, const std::filesystem::path& config, Report& report);

}  // namespace scanrig::ctl::doctor
