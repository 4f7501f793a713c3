#include "sim/wire/lightcrafter.h"

#include <algorithm>

namespace scanrig::sim::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::uint32_t word(const Bytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4 && at + i < bytes.size(); ++i) value += std::uint32_t{bytes[at + i]} << (8 * i);
  return value;
}

}  // namespace

void LightCrafter::receive(const Report& report) {
  std::optional<Flash> flash;
  std::function<void(const Flash&)> listener;
  {
    const std::scoped_lock lock(mutex_);
    settle();
    received_.push_back(report);
    message_.insert(message_.end(), report.begin(), report.end());
    const std::size_t announced = 4u + message_[2] + 256u * message_[3];
    if (message_.size() < announced) return;
    message_.resize(announced);
    const std::size_t before = flashes_.size();
    act();
    message_.clear();  // also of the one that restarted it
    if (flashes_.size() > before) flash = flashes_.back();
    listener = listener_;
  }
  if (flash && listener) listener(*flash);
}

std::optional<LightCrafter::Report> LightCrafter::next_report() {
  const std::scoped_lock lock(mutex_);
  if (outgoing_.empty()) return std::nullopt;
  const Report report = outgoing_.front();
  outgoing_.pop_front();
  return report;
}

void LightCrafter::trigger_in() {
  std::optional<Flash> flash;
  std::function<void(const Flash&)> listener;
  {
    const std::scoped_lock lock(mutex_);
    settle();
    if (!state_.started || state_.lit_until) return;
    light_up();
    flash = flashes_.back();
    listener = listener_;
  }
  if (listener) listener(*flash);
}

void LightCrafter::on_trigger_out(std::function<void(const Flash&)> listener) {
  const std::scoped_lock lock(mutex_);
  listener_ = std::move(listener);
}

std::vector<LightCrafter::Flash> LightCrafter::flashes() const {
  const std::scoped_lock lock(mutex_);
  return flashes_;
}

bool LightCrafter::lit() const {
  const std::scoped_lock lock(mutex_);
  return state_.lit_until && clock_.now() < *state_.lit_until;
}

std::vector<LightCrafter::Report> LightCrafter::received() const {
  const std::scoped_lock lock(mutex_);
  return received_;
}

void LightCrafter::inject(Fault fault, int replies) {
  const std::scoped_lock lock(mutex_);
  fault_ = fault;
  fault_replies_ = replies;
}

void LightCrafter::set_hardware_status(std::uint8_t status) {
  const std::scoped_lock lock(mutex_);
  state_.hardware = status;
}

void LightCrafter::power_cycle() {
  const std::scoped_lock lock(mutex_);
  restart();
}

int LightCrafter::enumeration() const {
  const std::scoped_lock lock(mutex_);
  return enumeration_;
}

/// Without a whole application the bootloader stays.
void LightCrafter::restart() {
  state_ = {};
  message_.clear();
  outgoing_.clear();
  is_programming_ = !flash_.version();
  ++enumeration_;
}

void LightCrafter::act() {
  const std::uint8_t flags = message_[0], sequence = message_[1];
  const Fault fault = fault_replies_ > 0 ? fault_ : Fault::none;
  if (fault != Fault::none) --fault_replies_;
  if (fault == Fault::refuse || message_.size() < 6) return reply(0x20, sequence, {});
  const auto command = static_cast<std::uint16_t>(message_[4] + 256 * message_[5]);
  const bool is_read = flags & 0x80;
  const Bytes sent(message_.begin() + 6, message_.end());
  const bool wants_reply = flags & 0x40;
  Bytes data;
  bool done = true;
  if (command == 0x3001 && !is_programming_ && !is_read) {
    restart();
    is_programming_ = true;
    return;
  }
  if (command == 0x0030 && is_programming_ && !is_read) return restart();
  if (is_read) {
    data = is_programming_ ? flash_.read(command, sent) : read(command);
    done = !data.empty();
  } else {
    done = is_programming_ ? flash_.write(command, sent) : write(command, sent);
  }
  if (fault == Fault::silent) return;
  if (fault == Fault::earlier_reply) reply(0, static_cast<std::uint8_t>(sequence - 1), {0});
  if (fault == Fault::endless_reply) data.resize(5000);
  if (wants_reply) reply(done ? 0 : 0x20, sequence, data);
}

bool LightCrafter::write(std::uint16_t command, const Bytes& data) {
  if (command == 0x0200) return true;  // power
  if (command == 0x1A24 && !data.empty()) {
    if (data[0] == 0) {
      if (state_.lit_until && !flashes_.empty()) flashes_.back().cut_short = true;
      state_.started = false;
      state_.lit_until.reset();
      return true;
    }
    if (data[0] != 2) return true;
    const bool ready = state_.checked && clock_.now() >= state_.check_ready && (state_.check & 0x13) == 0;
    if (!ready || !state_.pattern_mode || state_.source != 3 || state_.trigger_mode != 1) {
      state_.hardware |= 0x80;
      return true;
    }
    state_.started = true;
    if ((state_.patterns[0] & 3) == 0) light_up();
    return true;
  }
  if (state_.started) return false;
  state_.checked = state_.checked && command == 0x1A1A;
  return write_setting(command, data);
}

bool LightCrafter::write_setting(std::uint16_t command, const Bytes& data) {
  if (command == 0x1A1A) {
    check_settings();
    return true;
  }
  if (data.empty()) return false;
  switch (command) {
    case 0x1A1B: state_.pattern_mode = data[0] == 1; return true;
    case 0x1A22: state_.source = data[0]; return true;
    case 0x1A23: state_.trigger_mode = data[0]; return true;
    case 0x1A29:
      state_.exposure_us = word(data, 0);
      state_.period_us = word(data, 4);
      return data.size() == 8;
    case 0x1A31:
      if (data.size() != 4) return false;
      std::copy(data.begin(), data.end(), state_.config.begin());
      return true;
    case 0x1A33: state_.open_box = data[0]; return true;
    case 0x1A32: state_.address = data[0]; return true;
    case 0x1A34: {
      Bytes* box = state_.open_box == 2 ? &state_.patterns : state_.open_box == 1 ? &state_.images : nullptr;
      if (!box) return false;
      box->resize(state_.address);
      box->insert(box->end(), data.begin(), data.end());
      return true;
    }
    case 0x1A1D: return data.size() == 3 && data[1] <= 0xD5 && data[2] <= 0xD5;
    case 0x1A35: return data.size() == 4;
    case 0x1A07: return data[0] == 8;  // the LEDs follow the sequencer; the simulator supports no other mode
    case 0x0B01:
      if (data.size() != 3) return false;
      std::copy(data.begin(), data.end(), state_.current.begin());
      return true;
    default: return false;
  }
}

void LightCrafter::check_settings() {
  constexpr auto kCheckTime = std::chrono::milliseconds(5);
  state_.check = 0;
  if (state_.exposure_us < 235 || state_.exposure_us > 20'000'000) state_.check |= 0x01;
  if (state_.period_us != state_.exposure_us && state_.period_us < state_.exposure_us + 230) state_.check |= 0x10;
  const std::size_t wanted = 3u * (state_.config[0] + 1u);
  if (state_.patterns.size() < wanted || state_.images.size() < state_.config[3] + 1u ||
      (state_.patterns[0] >> 2) > 24 || (state_.patterns[1] & 0x0F) == 0) {
    state_.check |= 0x02;
  }
  state_.checked = true;
  state_.check_ready = clock_.now() + kCheckTime;
}

Bytes LightCrafter::read(std::uint16_t command) {
  switch (command) {
    case 0x0205: {
      Bytes versions(16);
      for (std::size_t i = 0; i < 4; ++i) versions[i] = static_cast<std::uint8_t>(*flash_.version() >> (8 * i));
      return versions;
    }
    case 0x1A0A: return {state_.hardware};
    case 0x1A0B: return {0x01};
    case 0x1A0C: return {static_cast<std::uint8_t>(state_.started ? 0x02 : 0x00)};
    case 0x1A1A: return {clock_.now() < state_.check_ready ? std::uint8_t{0x80} : state_.check};
    default: return {};
  }
}

void LightCrafter::light_up() {
  Flash flash;
  flash.at = clock_.now();
  flash.exposure = std::chrono::microseconds(state_.exposure_us);
  flash.image = state_.images[0];
  flash.pattern = state_.patterns[0] >> 2;
  flash.white = flash.pattern == 24;
  flash.depth = state_.patterns[1] & 0x0F;
  flash.current = state_.current;
  state_.lit_until = flash.at + flash.exposure;
  flashes_.push_back(flash);
}

/// Shows the sequence once.
void LightCrafter::settle() {
  if (!state_.lit_until || clock_.now() < *state_.lit_until) return;
  state_.lit_until.reset();
  state_.started = false;
}

void LightCrafter::reply(std::uint8_t flags, std::uint8_t sequence, const Bytes& data) {
  Bytes bytes{flags, sequence, static_cast<std::uint8_t>(data.size()), static_cast<std::uint8_t>(data.size() / 256)};
  bytes.insert(bytes.end(), data.begin(), data.end());
  for (std::size_t at = 0; at < bytes.size(); at += 64) {
    Report report{};
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), std::min<std::size_t>(64, bytes.size() - at),
                report.begin());
    outgoing_.push_back(report);
  }
}

}  // namespace scanrig::sim::wire
