#include "sim/wire/grbl_controller.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace scanrig::sim::wire {
namespace {

constexpr const char* kOk = "ok\r\n";
constexpr float kPullOff = 1.0F;       ///< $27, units: distance of home from the machine's zero
constexpr double kHomingTravel = 1.5;  ///< of the axis' travel, one table turn; then homing is given up
constexpr std::size_t kMaxGrblLine = 80;
constexpr double kJogDegS = 90;

std::string error(int number) { return fmt::format("error:{}\r\n", number); }

/// The words of a line, "G53 G1 X1.5" as {'X', 1.5} and so on; nothing for other text.
std::optional<std::multimap<char, double>> words_of(const std::string& text) {
  std::multimap<char, double> words;
  for (std::size_t at = 0; at < text.size();) {
    const char letter = text[at++];
    if (letter == ' ') continue;
    if (letter < 'A' || letter > 'Z') return std::nullopt;
    char* end = nullptr;
    const double value = std::strtod(text.c_str() + at, &end);
    if (end == text.c_str() + at) return std::nullopt;
    at = static_cast<std::size_t>(end - text.c_str());
    words.emplace(letter, value);
  }
  return words;
}

}  // namespace

GrblController::GrblController(const AxisOptions& axis, const GrblSettings& settings, Clock& clock)
    : SimulatedDrive(axis, clock),
      settings_(settings),
      gear_ratio_(axis.gear_ratio),
      steps_per_unit_(static_cast<float>(axis.pulses_per_motor_rev / 360.0)),
      state_(settings.homing ? State::alarm : State::idle) {
  axis_.set_counter(0);
}

bool GrblController::is_realtime(char byte) {
  return byte == '?' || byte == '!' || byte == '~' || byte == 0x18 || byte == static_cast<char>(0x85);
}

float GrblController::position() const { return static_cast<float>(axis_.commanded()) / steps_per_unit_; }

AxisMotion GrblController::motion(double deg_s) const {
  const double steps_per_deg = pulses_per_motor_rev_ * gear_ratio_ / 360.0;
  const double rate = settings_.acceleration_deg_s2 * steps_per_deg;
  return {std::min(deg_s, settings_.max_deg_s) * steps_per_deg, rate, rate};
}

std::string GrblController::greeting() const {
  switch (settings_.firmware) {
    case GrblFirmware::grblhal: return "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n";
    case GrblFirmware::fluidnc: return "\r\nGrbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]\r\n";
    case GrblFirmware::grbl: break;
  }
  return "\r\nGrbl 1.1h ['$' for help]\r\n";
}

std::string GrblController::lock() const {
  switch (settings_.firmware) {
    case GrblFirmware::grblhal: return "ALARM:11\r\n[MSG:Homing cycle required]\r\n";
    case GrblFirmware::fluidnc: return "[MSG:INFO: '$H'|'$X' to unlock]\r\n" + alarm(14);
    case GrblFirmware::grbl: break;
  }
  return "[MSG:'$H'|'$X' to unlock]\r\n";
}

std::string GrblController::alarm(int number) const {
  const bool says_more = settings_.firmware == GrblFirmware::fluidnc;
  return fmt::format("{}ALARM:{}\r\n", says_more ? "[MSG:INFO: ALARM: see the number]\r\n" : "", number);
}

std::string GrblController::build_info() const {
  switch (settings_.firmware) {
    case GrblFirmware::grblhal:
      return "[VER:1.1f.20240812:]\r\n[OPT:VNMSL,35,1024,4,0]\r\n[NEWOPT:ENUMS,RT-,ES]\r\n[FIRMWARE:grblHAL]\r\n"
             "[DRIVER:RP2040]\r\nok\r\n";
    case GrblFirmware::fluidnc:
      return "[VER:3.7 FluidNC v3.7.8:]\r\n[OPT:PHS]\r\n[MSG:INFO: Machine: turntable]\r\nok\r\n";
    case GrblFirmware::grbl: break;
  }
  return "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n";
}

std::string GrblController::report() const {
  static const std::map<State, const char*> names{
      {State::idle, "Idle"}, {State::run, "Run"}, {State::alarm, "Alarm"}, {State::home, "Home"}};
  const std::string name = state_ == State::hold ? (axis_.running() ? "Hold:1" : "Hold:0") : names.at(state_);
  if (settings_.firmware == GrblFirmware::grblhal) {
    // Four axes, and the reason of an alarm.
    return fmt::format("<{}{}|MPos:{:.3f},0.000,0.000,0.000|Bf:35,1024|FS:0,0|Pn:>\r\n", name,
                       state_ == State::alarm ? ":11" : "", position());
  }
  return fmt::format("<{}|MPos:{:.3f},0.000,0.000|FS:0,0>\r\n", name, position());
}

std::string GrblController::realtime(char byte) {
  const std::scoped_lock lock(mutex_);
  refresh();
  switch (byte) {
    // While homing, GRBL accepts nothing but a reset; the others report.
    case '?': return state_ == State::home && settings_.firmware == GrblFirmware::grbl ? std::string() : report();
    case '!':
      if (state_ == State::run) axis_.slow_down();
      if (state_ == State::run || state_ == State::idle) state_ = State::hold;
      return {};
    case '~':
      if (state_ == State::hold && !axis_.running()) state_ = State::idle;
      return {};
    case 0x18: {
      const bool moved = axis_.running();
      if (moved) {
        output_ += alarm(state_ == State::home ? 6 : 3);
        state_ = State::alarm;
      }
      if (state_ != State::alarm) state_ = State::idle;
      restart();
      return {};
    }
    default: return {};
  }
}

/// After a reset: the position is kept, as far as it is valid, and the lock too.
void GrblController::restart() const {
  axis_.quick_stop();
  lines_.clear();
  output_ += greeting();
  if (state_ == State::alarm) output_ += lock();
  critical_ = false;
  if (stays_ != 0) {
    critical_ = true;
    output_ += alarm(stays_);
  }
}

void GrblController::line(const std::string& text) {
  const std::scoped_lock lock(mutex_);
  refresh();
  lines_.push_back(text);
  advance();
}

std::string GrblController::take_output() {
  const std::scoped_lock lock(mutex_);
  refresh();
  return std::exchange(output_, {});
}

void GrblController::follow() const {
  if (state_ == State::run && !axis_.running()) state_ = State::idle;
  if (state_ == State::home) {
    if (!axis_.running() && axis_.reached_switch()) {
      axis_.set_counter(-static_cast<std::int32_t>(std::lround(kPullOff * steps_per_unit_)));
      state_ = State::idle;
      output_ += kOk;
    } else if (clock_.now() >= give_up_homing_) {
      axis_.quick_stop();
      state_ = State::alarm;
      output_ += alarm(9);
    }
  }
  advance();
}

/// Lines are read only where GRBL reads them: not in a hold, not while homing, not after a critical alarm.
void GrblController::advance() const {
  while (!lines_.empty() && state_ != State::hold && state_ != State::home && !critical_) {
    const std::string text = lines_.front();
    lines_.pop_front();
    carry_out(text);
  }
}

void GrblController::carry_out(const std::string& text) const {
  if (text.empty()) {
    output_ += kOk;
  } else if (text.size() > kMaxGrblLine) {
    output_ += error(11);
  } else if (text == "$H") {
    settings_.homing ? start_homing() : static_cast<void>(output_ += error(5));
  } else if (text == "$X") {
    if (state_ == State::alarm) state_ = State::idle;
    output_ += kOk;
  } else if (text == "$$") {
    output_ += list_settings();
  } else if (text == "$I") {
    output_ += build_info();
  } else if (text.front() == '$') {
    output_ += error(3);
  } else {
    output_ += state_ == State::alarm ? error(9) : g_code(text);
  }
}

std::string GrblController::list_settings() const {
  const double units_per_deg = gear_ratio_;
  const auto axis =
      fmt::format("$100={:.3f}\r\n$110={:.3f}\r\n$120={:.3f}\r\n", steps_per_unit_,
                  settings_.max_deg_s * units_per_deg * 60.0, settings_.acceleration_deg_s2 * units_per_deg);
  const int homing = settings_.homing ? 1 : 0;
  switch (settings_.firmware) {
    case GrblFirmware::grblhal:  // masks, and texts among the numbers
      return fmt::format(
          "$0=10.0\r\n$10=511\r\n$13=0\r\n$20=0\r\n$22={}\r\n$27={:.3f}\r\n{}$302=192.168.5.1\r\n$341=0\r\nok\r\n",
          settings_.homing ? 5 : 4, kPullOff, axis);
    case GrblFirmware::fluidnc:  // few: the others are in its file
      return fmt::format("$10=1\r\n$20=0\r\n$21=0\r\n$22={}\r\n$23=0\r\n$30=0\r\n$32=0\r\n{}$130=1000.000\r\nok\r\n",
                         homing, axis);
    case GrblFirmware::grbl: break;
  }
  return fmt::format("$0=10\r\n$10=1\r\n$13=0\r\n$20=0\r\n$22={}\r\n$27={:.3f}\r\n{}ok\r\n", homing, kPullOff, axis);
}

void GrblController::start_homing() const {
  axis_.seek_home(motion(settings_.homing_deg_s));
  state_ = State::home;
  give_up_homing_ = clock_.now() + std::chrono::milliseconds(
                                       static_cast<int>(1000.0 * kHomingTravel * 360.0 / settings_.homing_deg_s));
}

/// Straight moves of X in machine coordinates; all other G-code is refused.
std::string GrblController::g_code(const std::string& text) const {
  const auto words = words_of(text);
  if (!words) return error(1);
  bool straight = false, machine = false, absolute = true;
  const auto [first, last] = words->equal_range('G');
  for (auto word = first; word != last; ++word) {
    switch (static_cast<int>(word->second)) {
      case 1: straight = true; break;
      case 53: machine = true; break;
      case 91: absolute = false; break;
      case 21:
      case 90:
      case 94: break;
      default: return error(20);
    }
  }
  const auto x = words->find('X'), f = words->find('F');
  if (!straight || !machine || !absolute || words->size() != static_cast<std::size_t>(std::distance(first, last)) + 2) {
    return error(20);
  }
  if (x == words->end()) return error(26);
  if (f == words->end() || f->second <= 0) return error(22);
  const auto steps = std::lround(static_cast<float>(x->second) * steps_per_unit_);
  axis_.move_to(static_cast<std::int32_t>(steps), motion(f->second / 60.0 / gear_ratio_));
  state_ = State::run;
  return kOk;
}

void GrblController::raise_alarm(std::uint16_t code, bool can_be_reset) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.quick_stop();
  state_ = State::alarm;
  critical_ = code == 1 || code == 2;
  stays_ = can_be_reset ? 0 : code;
  output_ += alarm(code);
}

void GrblController::power_cycle() {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.set_counter(0);
  stays_ = 0;
  state_ = settings_.homing ? State::alarm : State::idle;
  restart();
}

void GrblController::send(std::int32_t pulses) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.move_to(axis_.commanded() + pulses, motion(kJogDegS));
  state_ = State::run;
}

}  // namespace scanrig::sim::wire
