#include <sys/prctl.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "config/setup/setup.h"
#include "core/files.h"
#include "core/signal_stop.h"
#include "daemon/api/json_replies.h"
#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/ctl/motion_session.h"
#include "daemon/ctl/offline_rig_config.h"
#include "daemon/ctl/verbs.h"
#include "daemon/rig/open_devices.h"
#include "drivers/projector/lightcrafter_flash.h"

namespace scanrig::ctl {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kMoveLimit{60};
constexpr seconds kAskLimit{2};
constexpr const char* kWarning = "The table is going to turn. Is everyone clear?";

std::string_view word(TurntableStatus::Motion motion) {
  switch (motion) {
    case TurntableStatus::Motion::stopped: return "stopped";
    case TurntableStatus::Motion::moving: return "moving";
    case TurntableStatus::Motion::unknown: break;
  }
  return "unknown: it may be moving";
}

ExitCode tell(const TurntableStatus& status, bool as_json) {
  if (as_json) {
    nlohmann::ordered_json all{{"motion", word(status.motion)}, {"homed", status.homed}, {"alarm", status.alarm}};
    all["angle_deg"] = status.angle ? nlohmann::ordered_json(status.angle->value) : nullptr;
    fmt::print("{}\n", all.dump());
    return ExitCode::ok;
  }
  fmt::print("motion: {}\nhomed: {}\n", word(status.motion), status.homed ? "yes" : "not since this command began");
  if (status.angle) fmt::print("angle: {:.3f} deg\n", status.angle->value);
  fmt::print("alarm: {}\n", status.alarm.empty() ? "none" : status.alarm);
  return ExitCode::ok;
}

Result<void> home(Turntable& table, Clock& clock) {
  if (auto reset = table.reset_alarm(Deadline::after(clock, kAskLimit)); !reset) return reset;
  return table.home(Deadline::after(clock, kMoveLimit));
}

ExitCode print_move(const TurntableVerb& verb, const Move& moved) {
  const auto ms = [](Clock::Duration time) { return std::chrono::duration_cast<milliseconds>(time).count(); };
  if (verb.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"measured_deg", moved.measured.value},
                                              {"moving_ms", ms(moved.moving)},
                                              {"settling_ms", ms(moved.settling)}}
                           .dump());
    return ExitCode::ok;
  }
  fmt::print("{:.3f} deg, {} ms moving, {} ms settling\n", moved.measured.value, ms(moved.moving), ms(moved.settling));
  return ExitCode::ok;
}

ExitCode move(const TurntableVerb& verb, const config::RigConfig& rig, Clock& clock) {
  if (!agreed(kWarning, verb.yes)) {
    return report_error(ExitCode::refused, "nothing was moved: reply y, or give --yes where there is no terminal");
  }
  Move move;
  const auto moved = with_motion(rig, verb.config, clock, [&](Motion& motion) {
    return motion.turn([&](Turntable& table) -> Result<void> {
      if (auto homed = home(table, clock); !homed || verb.what == "home") return homed;
      const auto turned = table.rotate_to({verb.angle_deg}, Deadline::after(clock, kMoveLimit));
      if (!turned) return pass_on(turned);
      move = *turned;
      return {};
    });
  });
  if (!moved) return report_error(of_device(moved.error()));
  if (verb.what == "move") return print_move(verb, move);
  fmt::print("{}\n", verb.json ? R"({"homed": true})" : "home");
  return ExitCode::ok;
}

/// Registers of the drive, whether or not this program homed it.
ExitCode read_registers(const config::RigConfig& rig, Clock& clock, bool as_json) {
  const auto& options = rig.turntable.modbus;
  ModbusDrive drive(options.line, options.profile, clock);
  const auto state = drive.read_state(Deadline::after(clock, kAskLimit));
  if (!state) return report_error(of_device(state.error().in("turntable")));
  const auto alarm = drive.read_alarm(Deadline::after(clock, kAskLimit));
  if (!alarm) return report_error(of_device(alarm.error().in("turntable")));
  const double angle = options.scale.angle(state->position).value;
  if (as_json) {
    const nlohmann::ordered_json all{{"pulses", state->position}, {"angle_deg", angle},
                                     {"running", state->running}, {"in_position", state->in_position},
                                     {"enabled", state->enabled}, {"homed", state->homed},
                                     {"fault", state->fault},     {"alarm", *alarm}};
    fmt::print("{}\n", all.dump());
    return ExitCode::ok;
  }
  fmt::print("{} pulses, {:.3f} deg{}\n", state->position, angle, state->homed ? "" : " (the drive has no home)");
  for (const auto& [is, what] :
       {std::pair(state->running, "running"), std::pair(state->in_position, "in position"),
        std::pair(state->enabled, "enabled"), std::pair(state->homed, "homed"), std::pair(state->fault, "fault")}) {
    if (is) fmt::print("{}\n", what);
  }
  if (!alarm->empty()) fmt::print("alarm: {}\n", *alarm);
  return ExitCode::ok;
}

}  // namespace

ExitCode turntable(const TurntableVerb& verb) {
  const auto rig = offline_rig_config(verb.config);
  if (!rig) return report_error(rig.error());
  RealClock clock;
  // A GRBL controller has no registers: its reply is its status.
  const bool registers = rig->turntable.driver == config::TurntableConfig::Driver::modbus;
  if (verb.what == "read" && registers) return read_registers(*rig, clock, verb.json);
  if (verb.what != "status" && verb.what != "read") return move(verb, *rig, clock);
  const auto table = open_turntable(rig->turntable, clock);
  if (!table) return report_error(table.error());
  const auto status = (*table)->status(Deadline::after(clock, kAskLimit));
  return status ? tell(*status, verb.json) : report_error(of_device(status.error()));
}

namespace {

constexpr std::chrono::milliseconds kGlance{200};

void print_inputs(const PanelInputs& now, Clock::Duration since) {
  fmt::print("{:9.3f} s  e-stop {}  guard {}  part {}  {}{}{}\n", std::chrono::duration<double>(since).count(),
             now.estop_ok ? "ok" : "PRESSED", now.guard_closed ? "closed" : "OPEN", now.part_present ? "there" : "-",
             now.start ? "[start]" : "", now.stop ? "[stop]" : "", now.reset ? "[reset]" : "");
  std::fflush(stdout);
}

void print_inputs_json(const PanelInputs& now, Clock::Duration since) {
  fmt::print("{}\n", nlohmann::ordered_json{{"after_s", std::chrono::duration<double>(since).count()},
                                            {"estop_ok", now.estop_ok},
                                            {"guard_closed", now.guard_closed},
                                            {"part_present", now.part_present},
                                            {"flipped", now.flipped},
                                            {"start", now.start},
                                            {"stop", now.stop},
                                            {"reset", now.reset}}
                         .dump());
  std::fflush(stdout);
}

}  // namespace

ExitCode watch_panel(const PanelVerb& verb) {
  const auto rig = offline_rig_config(verb.config);
  if (!rig) return report_error(rig.error());
  RealClock clock;
  const auto open = open_devices(*rig, clock);
  if (!open) return report_error(open.error());
  const SignalStop signal;
  const auto begun = clock.now();
  const auto end = verb.seconds > 0 ? begun + std::chrono::seconds(verb.seconds) : Clock::TimePoint::max();
  PanelInputs known;
  for (bool first = true; !signal.token().stop_requested() && clock.now() < end; first = false) {
    const auto now = open->panel->wait_change(known, Deadline::after(clock, first ? Clock::Duration{} : kGlance));
    if (!now) return report_error(of_device(now.error()));
    if (first || *now != known) (verb.json ? print_inputs_json : print_inputs)(*now, clock.now() - begun);
    known = *now;
  }
  return ExitCode::ok;
}

namespace {

constexpr std::chrono::minutes kLoadLimit{15};

ExitCode print_version(const dlpc350::Version& version, bool as_json) {
  const std::string text = to_string(version);
  if (as_json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"model", "LightCrafter 4500"}, {"firmware", text}}.dump());
  } else {
    fmt::print("LightCrafter 4500, firmware {}\n", text);
  }
  return ExitCode::ok;
}

/// A line per tenth, on standard error.
void print_progress(std::string_view step, double share) {
  static std::string last;
  std::string line = fmt::format("{} {:.0f} %", step, std::floor(share * 10) * 10);
  if (line == last) return;
  fmt::print(stderr, "{}\n", line);
  last = std::move(line);
}

ExitCode load_projector(const ProjectorVerb& verb, const dlpc350::OpenTransport& open, Clock& clock) {
  if (verb.file.empty()) return report_error(ExitCode::usage, "projector load: name the firmware's FILE");
  const auto text = read_file(verb.file);
  if (!text) return report_error(text.error());
  const std::vector<std::uint8_t> file(text->begin(), text->end());
  const auto version = dlpc350::check_firmware_file(file);
  if (!version) return report_error(version.error().in(verb.file.string()));
  if (!agreed("The projector's firmware is replaced: keep its power and cable. Go on?", verb.yes)) {
    return report_error(ExitCode::refused, "nothing was written: reply y, or give --yes where there is no terminal");
  }
  const auto loaded = dlpc350::load_firmware(file, open, &print_progress, clock, Deadline::after(clock, kLoadLimit));
  return loaded ? print_version(*loaded, verb.json) : report_error(of_device(loaded.error()));
}

}  // namespace

ExitCode projector(const ProjectorVerb& verb) {
  const auto rig = offline_rig_config(verb.config);
  if (!rig) return report_error(rig.error());
  if (rig->projector.driver != config::ProjectorConfig::Driver::lightcrafter4500) {
    return report_error(ExitCode::refused, "projector: it has no firmware, only a LightCrafter 4500 has");
  }
  RealClock clock;
  const auto open = dlpc350::usb_transport(rig->projector.serial, clock);
  if (verb.what == "load") return load_projector(verb, open, clock);
  dlpc350::Link link(open, rig->projector.lightcrafter.reply_timeout, clock);
  if (auto opened = link.open(); !opened) return report_error(of_device(opened.error().in("projector")));
  const auto version = dlpc350::read_version(link, Deadline::after(clock, kAskLimit));
  if (!version) return report_error(of_device(version.error().in("projector")));
  if (*version) return print_version(**version, verb.json);
  return report_error(ExitCode::device,
                      "projector: the LightCrafter has no whole firmware; write it with scanrig projector load");
}

namespace {

/// At the page the service is at the other end of the pipes: where it dies, this program must let go of the devices.
doctor::Operator person_for(bool page, bool interactive, bool quiet_output) {
  if (!page) return {interactive, quiet_output};
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  return {true, quiet_output, doctor::Operator::Face::page};
}

/// Examines the rig, prints the report, and keeps it for the page. Fails as doctor::examine_rig().
Result<void> consult(const doctor::Rig& rig, bool may_turn, bool as_json, const doctor::Operator& person, Clock& clock,
                     doctor::Report& report) {
  const auto moved = doctor::examine_rig(rig, may_turn, person, clock, report);
  const std::string written = report.json();
  if (person.face() == doctor::Operator::Face::page) {
    person.tell(report.text());
  } else {
    fmt::print("{}", as_json ? written : report.text());
  }
  // A job folder that is missing, or not to be written to, has its finding.
  std::ignore = write_file_atomically(rig.config.storage.root / kDoctorFile, written);
  return moved;
}

}  // namespace

ExitCode examine_rig(const DoctorVerb& verb) {
  // For the page the service runs, but has lent its devices.
  const auto rig = verb.page ? config::read_rig_config(verb.config) : offline_rig_config(verb.config);
  if (!rig) return report_error(rig.error());
  RealClock clock;
  const auto person = person_for(verb.page, verb.answers, verb.json);
  doctor::Report report;
  const auto moved = consult({*rig, verb.config, verb.machine_root}, verb.yes_move, verb.json, person, clock, report);
  if (!moved) return report_error(moved.error());
  const auto found = report.findings().size();
  if (found == 0) return ExitCode::ok;
  return report_error(ExitCode::device,
                      fmt::format("{}: {} finding(s); with each stands what to do", verb.config.string(), found));
}

namespace {

constexpr const char* kNext =
    "Next: systemctl start scanrigd, press Reset at the panel, and scanrig open --role engineer for the page.\n"
    "There set focus and exposure, then calibrate.";

/// The conversation of setup, with the person whom the doctor talks to.
class OperatorDialogue final : public config::setup::Dialogue {
 public:
  explicit OperatorDialogue(const doctor::Operator& person) : person_(person) {}
  void tell(const std::string& text) const override { person_.tell(text); }
  [[nodiscard]] Result<std::string> prompt(const config::setup::Question& question) const override {
    auto reply = person_.prompt(question);
    if (!reply) return fail(ErrorCode::refused, "setup: the replies have ended; nothing was written");
    while (!reply->empty() && reply->back() <= ' ') reply->pop_back();
    return *std::move(reply);
  }

 private:
  const doctor::Operator& person_;
};

/// What is left to do of the doctor's findings: a reversed direction is corrected in the file, and the calibration
/// comes next. Fails as consult() and save().
Result<std::size_t> examine(config::setup::Setup& setup, const doctor::Rig& rig, const doctor::Operator& person,
                            Clock& clock) {
  doctor::Report report;
  if (auto moved = consult(rig, false, false, person, clock, report); !moved) return pass_on(moved);
  std::size_t left = report.findings().size();
  for (const auto& finding : report.findings()) {
    if (finding.id == "no_calibration") --left;
    if (finding.id != "reversed_sign") continue;
    setup.reverse_sign();
    if (auto saved = setup.save(); !saved) return pass_on(saved);
    fmt::print("The direction of positive pulses is corrected in {}.\n", rig.file.string());
    --left;
  }
  return left;
}

}  // namespace

ExitCode set_up(const SetupVerb& verb) {
  const auto& file = verb.options.out;
  std::error_code error;
  if (!verb.page && std::filesystem::exists(file, error)) {
    return report_error(
        ExitCode::refused,
        fmt::format("setup: {} is there already; move it away, or name another file with --out", file.string()));
  }
  const auto person = person_for(verb.page, verb.answers, false);
  if (!person.there()) {
    return report_error(ExitCode::refused,
                        "setup: no person is there to reply; run it at a terminal, or with --interactive");
  }
  RealClock clock;
  const OperatorDialogue dialogue(person);
  config::setup::Setup setup(verb.options, dialogue, clock);
  const auto rig = setup.run();
  if (!rig) return report_error(of_device(rig.error()));
  if (verb.page) return ExitCode::ok;  // the page shows it first, and runs the doctor after
  fmt::print("{} is written. The doctor examines the rig.\n", file.string());
  const auto left = examine(setup, {*rig, file}, person, clock);
  if (!left) return report_error(left.error());
  if (*left > 0) {
    return report_error(
        ExitCode::device,
        fmt::format("{} is written; {} finding(s) of the doctor remain, with what to do", file.string(), *left));
  }
  fmt::print("{}\n", kNext);
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
