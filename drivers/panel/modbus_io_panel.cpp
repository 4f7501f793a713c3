#include "drivers/panel/modbus_io_panel.h"

#include <algorithm>

namespace scanrig {
namespace {

constexpr int kAttempts = 2;
constexpr int kReplyTimeouts = 8;  ///< of one reading: coils and inputs, each after a quiet line, and some margin

}  // namespace

template <class Wired>
ModbusIoPanel::Span ModbusIoPanel::span_of(const Wired& wired) {
  if (wired.empty()) return {};
  const auto by_address = [](const auto& a, const auto& b) { return a.second.address < b.second.address; };
  const auto [first, last] = std::minmax_element(wired.begin(), wired.end(), by_address);
  return {first->second.address, last->second.address - first->second.address + 1};
}

ModbusIoPanel::ModbusIoPanel(ModbusIoPanelOptions options, Clock& clock)
    : options_(std::move(options)),
      clock_(clock),
      bus_(modbus::Bus::at(options_.line, clock)),
      inputs_(span_of(options_.inputs)),
      coils_(span_of(options_.outputs)),
      next_poll_(clock.now()) {}

Result<PanelInputs> ModbusIoPanel::wait_change(const PanelInputs& known, Deadline deadline) {
  for (;;) {
    if (debounce_) {
      const PanelInputs now = debounce_->settled();
      if (now != known || deadline.expired(clock_)) {
        if (auto free = debounce_->none_stuck(); !free) {
          std::ignore = poll();  // or a released button would stay stuck; a failure occurs again at the next call
          return pass_on(free);
        }
        return now;
      }
      clock_.sleep_until(std::min(deadline.at, next_poll_));
      if (clock_.now() < next_poll_) continue;
    }
    if (auto read = poll(); !read) return pass_on(read, "panel");
  }
}

/// After a failed reading the earlier inputs are discarded: a button pressed at the next reading is not a press.
Result<void> ModbusIoPanel::poll() {
  const auto bus = bus_->turn();
  auto read = read_once(bus);
  for (int attempt = 1; attempt < kAttempts && !read && bus->reply_missed(); ++attempt) {
    bus->count_retry();
    read = read_once(bus);
  }
  next_poll_ = clock_.now() + options_.poll;
  if (!read) debounce_.reset();
  return read;
}

Result<void> ModbusIoPanel::read_once(const Turn& bus) {
  const auto deadline = Deadline::after(clock_, kReplyTimeouts * options_.line.reply_timeout);
  if (auto as_shown = coils_as_shown(bus, deadline); !as_shown) return as_shown;
  const auto bits = bus->read_inputs(inputs_.first, inputs_.count, deadline);
  if (!bits) return pass_on(bits);
  std::vector<bool> levels;
  std::vector<bool PanelInputs::*> fields;
  for (const auto& [field, signal] : options_.inputs) {
    levels.push_back((*bits)[signal.address - inputs_.first] != signal.active_low);
    fields.push_back(field);
  }
  if (!debounce_) debounce_.emplace(fields);
  debounce_->take(levels, clock_.now());
  return {};
}

/// Reads the coils even without outputs; then the module may refuse the request.
Result<void> ModbusIoPanel::coils_as_shown(const Turn& bus, Deadline deadline) {
  const auto bits = bus->read_coils(coils_.first, coils_.count, deadline);
  if (options_.outputs.empty() && !bits && bits.error().code == ErrorCode::protocol && !bus->reply_missed()) {
    return {};
  }
  if (!bits) return pass_on(bits);
  if (!shown_) return {};
  for (const auto& [field, signal] : options_.outputs) {
    if ((*bits)[signal.address - coils_.first] == ((*shown_).*field != signal.active_low)) continue;
    shown_.reset();
    return fail(ErrorCode::protocol, "coil {} is not as it was set: was the module switched off? check its supply",
                signal.address);
  }
  return {};
}

Result<void> ModbusIoPanel::show(const PanelOutputs& outputs, Deadline deadline) {
  const auto bus = bus_->turn();
  auto written = write(bus, outputs, deadline);
  if (!written && bus->reply_missed()) {  // writing twice does no harm
    bus->count_retry();
    written = write(bus, outputs, deadline);
  }
  shown_.reset();
  if (!written) return pass_on(written, "panel");
  shown_ = outputs;
  return {};
}

/// Coils between the panel's belong to other drivers and are not written.
Result<void> ModbusIoPanel::write(const Turn& bus, const PanelOutputs& outputs, Deadline deadline) {
  if (options_.outputs.size() == static_cast<std::size_t>(coils_.count)) {
    std::vector<bool> bits(options_.outputs.size());
    for (const auto& [field, signal] : options_.outputs) {
      bits[signal.address - coils_.first] = outputs.*field != signal.active_low;
    }
    return bus->write_coils(coils_.first, bits, deadline);
  }
  for (const auto& [field, signal] : options_.outputs) {
    if (shown_ && (*shown_).*field == outputs.*field) continue;
    auto written = bus->write_coil(signal.address, outputs.*field != signal.active_low, deadline);
    if (!written) return written;
  }
  return {};
}

}  // namespace scanrig
