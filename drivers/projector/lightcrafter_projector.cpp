#include "drivers/projector/lightcrafter_projector.h"

#include <cmath>

namespace scanrig {
namespace {

using dlpc350::Command;
using dlpc350::LutEntry;
using std::chrono::milliseconds;

constexpr int kAllWhite = 24;
constexpr double kDelayStep = 107.2;                         // ns
constexpr int kZeroDelay = 0xBB;                             // of the trigger output, in steps
constexpr std::chrono::microseconds kMinLength{235};         // exposure of a pattern of one bit [DLPU010, table 2-65]
constexpr std::chrono::microseconds kMaxLength{10'000'000};  // long enough for any rig
constexpr milliseconds kPoll{2};
constexpr std::uint8_t kImages = 1, kPatterns = 2;  // mailboxes

std::vector<std::uint8_t> little_endian(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)};
}

int steps(std::chrono::nanoseconds delay) {
  return static_cast<int>(std::lround(static_cast<double>(delay.count()) / kDelayStep));
}

}  // namespace

Result<std::unique_ptr<LightCrafterProjector>> LightCrafterProjector::create(const LightCrafterOptions& options,
                                                                             dlpc350::OpenTransport open,
                                                                             Clock& clock) {
  const auto outside = [](const char* what) {
    return fail(ErrorCode::out_of_range, "projector: {} is outside what a LightCrafter 4500 can do", what);
  };
  if (options.image < 0 || options.image > 63) return outside("the image's index (0 to 63)");
  if (options.pattern < 0 || options.pattern >= kAllWhite) return outside("the pattern (0 to 23)");
  if (options.depth < 1 || options.depth > 8) return outside("the depth (1 to 8 bits)");
  if (options.exposure < kMinLength || options.exposure > kMaxLength) return outside("the exposure (235 us to 10 s)");
  const int out_delay = kZeroDelay + steps(options.trigger_out_delay);
  if (out_delay < 0 || out_delay > 0xD5) return outside("the trigger output's delay (-20 to 2.7 us)");
  if (options.trigger_in_delay.count() < 0) return outside("the trigger input's delay (not negative)");
  return std::unique_ptr<LightCrafterProjector>(new LightCrafterProjector(options, std::move(open), clock));
}

Result<void> LightCrafterProjector::fire(Light light, Deadline deadline) {
  {
    const std::scoped_lock lock(mutex_);
    dark_requested_ = false;
  }
  if (auto connected = connect(deadline); !connected) return connected;
  if (!set_up_) {
    if (auto set = set_up(deadline); !set) return set;
  }
  if (loaded_ != light) {
    if (auto loaded = load(light, deadline); !loaded) return loaded;
  }
  if (deadline.left(clock_) < options_.exposure) {
    return fail(ErrorCode::timeout, "projector: an exposure of {} us does not fit before the deadline",
                options_.exposure.count());
  }
  auto over = write(Command::start_stop, {2}, deadline);
  if (over) over = wait_until_over(deadline);
  if (over) return expect_healthy(deadline);
  // It may have started although its reply was lost.
  const auto darkened = turn_off(Deadline::after(clock_, options_.reply_timeout));
  return darkened ? over : pass_on(over, "the light may be on");
}

Result<void> LightCrafterProjector::turn_off(Deadline deadline) {
  if (auto connected = connect(deadline); !connected) return pass_on(connected, "the light may be on");
  if (auto stopped = stop(deadline); !stopped) return pass_on(stopped, "the light may be on");
  return {};
}

void LightCrafterProjector::request_off() noexcept {
  {
    const std::scoped_lock lock(mutex_);
    dark_requested_ = true;
  }
  clock_.notify_all(wake_);
}

Result<void> LightCrafterProjector::connect(Deadline deadline) {
  if (link_.is_open()) return {};
  if (auto opened = link_.open(); !opened) return pass_on(opened, "projector");
  set_up_ = false;
  if (auto known = check_firmware(deadline); !known) {
    link_.close();
    return known;
  }
  if (auto awake = write(Command::power, {0}, deadline); !awake) return awake;
  if (auto healthy = expect_healthy(deadline); !healthy) return healthy;
  if (auto stopped = stop(deadline); !stopped) return stopped;  // ends what the device showed when it was lost
  return write(Command::display_mode, {1}, deadline);
}

Result<void> LightCrafterProjector::check_firmware(Deadline deadline) {
  const auto version = dlpc350::read_version(link_, deadline);
  if (!version) return pass_on(version, "projector");
  if (!*version) {
    return fail(ErrorCode::unsupported,
                "projector: the LightCrafter has no whole firmware; write it with scanrig projector load");
  }
  description_ = "LightCrafter 4500, firmware " + to_string(**version);
  if (**version >= dlpc350::kOldestFirmware) return {};
  return fail(ErrorCode::unsupported,
              "projector: the LightCrafter's firmware {} is older than {}; update it with scanrig projector load",
              to_string(**version), to_string(dlpc350::kOldestFirmware));
}

/// Sends all settings that do not depend on the light, once per connection. Order matters; the device takes settings
/// when stopped.
Result<void> LightCrafterProjector::set_up(Deadline deadline) {
  set_up_ = false;
  loaded_.reset();
  const auto exposure = static_cast<std::uint32_t>(options_.exposure.count());
  std::vector<std::uint8_t> exposure_and_period = little_endian(exposure);
  for (const auto byte : little_endian(exposure)) exposure_and_period.push_back(byte);
  const auto out_delay = static_cast<std::uint8_t>(kZeroDelay + steps(options_.trigger_out_delay));
  const auto in_delay = static_cast<std::uint32_t>(steps(options_.trigger_in_delay));
  const std::uint8_t by_sequencer = 0x08;
  const Bytes currents(options_.led_current.begin(), options_.led_current.end());
  const std::vector<std::pair<Command, Bytes>> settings{
      {Command::led_current, currents},
      {Command::led_enable, {by_sequencer}},
      {Command::pattern_source, {3}},           // images in flash
      {Command::trigger_mode, {1}},             // internal, or the trigger inputs
      {Command::pattern_config, {0, 0, 0, 0}},  // one entry, once, one pattern to TRIG_OUT_2, one image
      {Command::exposure_period, exposure_and_period},
      {Command::trigger_out_1, {static_cast<std::uint8_t>(options_.trigger_out_inverted), out_delay, kZeroDelay}},
      {Command::trigger_in_1_delay, little_endian(in_delay)},
  };
  if (auto written = write_all(settings, deadline); !written) return written;
  if (auto sent = send_table(kImages, {static_cast<std::uint8_t>(options_.image)}, deadline); !sent) return sent;
  set_up_ = true;
  return {};
}

/// Writes the one entry of the pattern table, six commands. The device checks nothing before the validate command, and
/// every earlier exposure has been confirmed to be over.
Result<void> LightCrafterProjector::load(Light light, Deadline deadline) {
  loaded_.reset();
  LutEntry entry;
  entry.trigger = options_.trigger_in;
  entry.swap_buffer = true;
  entry.pattern = light == Light::pattern ? options_.pattern : kAllWhite;
  entry.depth = light == Light::pattern ? options_.depth : 1;
  const auto word = dlpc350::encode(entry);
  if (auto sent = send_table(kPatterns, {word.begin(), word.end()}, deadline); !sent) return sent;
  if (auto valid = validate(deadline); !valid) return valid;
  loaded_ = light;
  return {};
}

Result<void> LightCrafterProjector::send_table(std::uint8_t mailbox, const Bytes& data, Deadline deadline) {
  constexpr std::uint8_t kClosed = 0;
  const std::vector<std::pair<Command, Bytes>> steps{{Command::mailbox, {mailbox}},
                                                     {Command::mailbox_address, {0}},
                                                     {Command::mailbox_data, data},
                                                     {Command::mailbox, {kClosed}}};
  return write_all(steps, deadline);
}

Result<void> LightCrafterProjector::validate(Deadline deadline) {
  if (auto asked = write(Command::validate, {}, deadline); !asked) return asked;
  for (;;) {
    const auto result = read_byte(Command::validate, deadline);
    if (!result) return pass_on(result);
    if (!dlpc350::validating(*result)) {
      const std::string faults = dlpc350::validation_faults(*result);
      if (faults.empty()) return {};
      return fail(ErrorCode::invalid_input, "projector: the LightCrafter does not accept its settings: {}", faults);
    }
    if (deadline.expired(clock_)) return fail(ErrorCode::timeout, "projector: validating its settings takes too long");
    clock_.sleep_for(kPoll);
  }
}

Result<void> LightCrafterProjector::expect_healthy(Deadline deadline) {
  const auto hardware = read_byte(Command::hardware_status, deadline);
  if (!hardware) return pass_on(hardware);
  const auto system = read_byte(Command::system_status, deadline);
  if (!system) return pass_on(system);
  std::string faults = dlpc350::hardware_faults(*hardware);
  if (const auto more = dlpc350::system_faults(*system); !more.empty()) faults += (faults.empty() ? "" : ", ") + more;
  if (faults.empty()) return {};
  set_up_ = false;
  return fail(ErrorCode::device_alarm, "projector: the LightCrafter reports: {}; switch it off and on", faults);
}

Result<void> LightCrafterProjector::stop(Deadline deadline) {
  if (auto told = write(Command::start_stop, {0}, deadline); !told) return told;
  for (;;) {
    const auto on = running(deadline);
    if (!on) return pass_on(on);
    if (!*on) return {};
    if (deadline.expired(clock_)) {
      set_up_ = false;
      return fail(ErrorCode::timeout, "projector: told to stop, still shows a pattern");
    }
    clock_.sleep_for(kPoll);
  }
}

Result<bool> LightCrafterProjector::running(Deadline deadline) {
  const auto status = read_byte(Command::main_status, deadline);
  if (!status) return pass_on(status);
  return dlpc350::runs(*status);
}

/// Waits for `time`; returns true, and at once, if request_off() was called.
bool LightCrafterProjector::pause(Clock::Duration time) {
  std::unique_lock lock(mutex_);
  return clock_.wait_until(lock, wake_, clock_.now() + time, [&] { return dark_requested_; });
}

Result<void> LightCrafterProjector::wait_until_over(Deadline deadline) {
  // First checked when it can be over.
  for (Clock::Duration time = options_.exposure;; time = kPoll) {
    if (pause(time)) return fail(ErrorCode::io, "projector: went dark on request before the exposure was over");
    const auto on = running(deadline);
    if (!on) return pass_on(on);
    if (!*on) return {};
    if (deadline.expired(clock_)) {
      return fail(ErrorCode::timeout, "projector: the exposure is not over in time{}",
                  options_.trigger_in == LutEntry::Trigger::internal ? "" : "; is there an edge at its trigger input?");
    }
  }
}

Result<void> LightCrafterProjector::write_all(const std::vector<std::pair<Command, Bytes>>& steps, Deadline deadline) {
  for (const auto& [command, data] : steps) {
    if (auto written = write(command, data, deadline); !written) return written;
  }
  return {};
}

Result<void> LightCrafterProjector::write(Command command, const Bytes& data, Deadline deadline) {
  auto written = link_.write(command, data, deadline);
  if (!written) return pass_on(written, "projector");
  return {};
}

Result<std::uint8_t> LightCrafterProjector::read_byte(Command command, Deadline deadline) {
  const auto reply = link_.read(command, {}, 1, deadline);
  if (!reply) return pass_on(reply, "projector");
  return reply->front();
}

}  // namespace scanrig
