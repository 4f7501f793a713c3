#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <thread>

#include "drivers/panel/modbus_io_panel.h"
#include "sim/wire/pty.h"

// The panel's driver against a module that replies anything. The input is a row of replies. Before each, a byte gives
// its length. Its top bit adds a unit and a checksum that fit, so that the reply is read at all.
// For any input: no crash, and no endless wait (libFuzzer's own limit).

namespace {

using namespace scanrig;
using std::chrono::milliseconds;

constexpr std::uint8_t kUnit = 5;

class Module {
 public:
  explicit Module(const std::filesystem::path& link) {
    auto pty = sim::wire::Pty::open(link);
    if (!pty) std::abort();
    thread_ = std::jthread([this, p = std::move(*pty)](const std::stop_token& stop) mutable { serve(stop, p); });
  }
  void answer_with(const std::uint8_t* data, std::size_t size) {
    const std::scoped_lock lock(mutex_);
    script_.assign(data, data + size);
  }

 private:
  void serve(const std::stop_token& stop, sim::wire::Pty& pty) {
    while (!stop.stop_requested()) {
      if (!pty.read(milliseconds(5)).empty()) pty.write(next());
    }
  }
  sim::wire::Bytes next() {
    const std::scoped_lock lock(mutex_);
    if (script_.empty()) return {};
    const std::size_t length = std::min<std::size_t>(script_[0] & 0x7F, script_.size() - 1);
    const bool whole = (script_[0] & 0x80) != 0;
    sim::wire::Bytes answer(script_.begin() + 1, script_.begin() + 1 + static_cast<std::ptrdiff_t>(length));
    script_.erase(script_.begin(), script_.begin() + 1 + static_cast<std::ptrdiff_t>(length));
    if (!whole) return answer;
    answer.insert(answer.begin(), kUnit);
    return sim::wire::with_crc(std::move(answer));
  }

  std::mutex mutex_;
  sim::wire::Bytes script_;
  std::jthread thread_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto link = std::filesystem::temp_directory_path() / ("fuzz-io-" + std::to_string(::getpid()));
  static Module module(link);
  RealClock clock;
  module.answer_with(data, size);
  ModbusIoPanel panel({.line = {.device = link, .unit_id = kUnit, .reply_timeout = milliseconds(2)},
                       .inputs = {{&PanelInputs::start, {0}}, {&PanelInputs::estop_ok, {9}}},
                       .outputs = {{&PanelOutputs::red, {1}}, {&PanelOutputs::green, {4}}},
                       .poll = milliseconds(1)},
                      clock);
  for (int i = 0; i < 3; ++i) {
    std::ignore = panel.wait_change({}, Deadline::after(clock, milliseconds(2)));
    std::ignore = panel.show({.red = i % 2 == 0}, Deadline::after(clock, milliseconds(20)));
  }
  return 0;
}
