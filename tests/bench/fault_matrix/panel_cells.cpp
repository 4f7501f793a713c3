#include <atomic>
#include <map>
#include <optional>

#include "drivers/panel/gpio_panel.h"
#include "drivers/panel/modbus_io_panel.h"
#include "sim/wire/gpio_socket.h"
#include "sim/wire/modbus_io.h"
#include "sim/wire/modbus_server.h"
#include "tests/bench/fault_matrix/cells.h"

namespace scanrig::bench {
namespace {

using sim::wire::WireFault;
using std::chrono::milliseconds;

constexpr milliseconds kLimit{1000};
constexpr milliseconds kAmple{3000};
constexpr milliseconds kAbsence{2000};
constexpr milliseconds kLate{60};

/// A panel's driver with the far end of its wires: one button, the e-stop, one lamp.
class PanelEnd {
 public:
  virtual ~PanelEnd() = default;
  virtual Panel& panel() = 0;
  virtual void begin(Fault fault) = 0;
  virtual void end() = 0;
  virtual void press_start(bool pressed) = 0;
  virtual bool lamp() = 0;
  /// Opens the driver again, like the daemon after a device failure.
  virtual Result<void> open() = 0;
};

std::filesystem::path fresh(const std::filesystem::path& scratch, const char* what) {
  static std::atomic<int> count = 0;
  return scratch / fmt::format("{}{}", what, count++);
}

class GpioEnd final : public PanelEnd {
 public:
  GpioEnd(const std::filesystem::path& scratch, Clock& clock) : socket_(fresh(scratch, "gpio")), clock_(clock) {
    end();
    std::ignore = open();
  }
  Panel& panel() override { return *panel_; }
  void begin(Fault) override { far_end_.reset(); }
  void end() override {
    if (!far_end_)
      far_end_ = sim::wire::GpioSocket::start(socket_, {{"START", false}, {"LAMP", false}}, clock_).value();
  }
  void press_start(bool pressed) override { far_end_->set("START", pressed); }
  bool lamp() override { return far_end_->level("LAMP"); }
  Result<void> open() override {
    panel_.reset();
    GpioPanelOptions options;
    options.inputs.emplace_back(&PanelInputs::start, gpio::LineSpec{"START"});
    options.outputs.emplace_back(&PanelOutputs::green, gpio::LineSpec{"LAMP"});
    auto panel = GpioPanel::open(options, *lines_, clock_);
    if (!panel) return pass_on(panel);
    panel_ = std::move(*panel);
    return {};
  }

 private:
  const std::filesystem::path socket_;
  Clock& clock_;
  std::unique_ptr<sim::wire::GpioSocket> far_end_;
  std::unique_ptr<gpio::Lines> lines_ = gpio::socket_lines(socket_, clock_);
  std::unique_ptr<Panel> panel_;
};

class ModuleEnd final : public PanelEnd {
 public:
  ModuleEnd(const std::filesystem::path& scratch, Clock& clock) : port_(fresh(scratch, "module")), clock_(clock) {
    server_ = sim::wire::ModbusServer::start(port_, 2, module_, clock).value();
    std::ignore = open();
  }
  Panel& panel() override { return *panel_; }
  void begin(Fault fault) override {
    using Kind = WireFault::Kind;
    switch (fault) {
      case Fault::silent: return server_->inject({.kind = Kind::request_lost});
      case Fault::late: return server_->inject({.kind = Kind::late, .delay = kLate});
      case Fault::damaged: return server_->inject({.kind = Kind::wrong_crc});
      case Fault::earlier_answer: return server_->inject({.kind = Kind::earlier_reply});
      case Fault::device_error: return server_->inject({.kind = Kind::refuse});
      case Fault::stalled: return;
      case Fault::unplugged:
      case Fault::back_after_2s: return server_->vanish();
    }
  }
  void end() override {
    server_->clear_faults();
    std::ignore = server_->come_back();
  }
  void press_start(bool pressed) override { module_.set(0, pressed); }
  bool lamp() override { return module_.coil(0); }
  Result<void> open() override {
    ModbusIoPanelOptions options;
    options.line.device = port_;
    options.line.unit_id = 2;
    options.line.reply_timeout = milliseconds(30);
    options.inputs.emplace_back(&PanelInputs::start, ModbusIoPanelOptions::Signal{0});
    options.outputs.emplace_back(&PanelOutputs::green, ModbusIoPanelOptions::Signal{0});
    panel_ = std::make_unique<ModbusIoPanel>(options, clock_);
    return {};
  }

 private:
  const std::filesystem::path port_;
  Clock& clock_;
  sim::wire::ModbusIoModule module_{8, 8};
  std::unique_ptr<sim::wire::ModbusServer> server_;
  std::unique_ptr<ModbusIoPanel> panel_;
};

PanelOutputs green() { return {.green = true}; }

Outcome trial(PanelEnd& end, RealClock& clock, const std::string& method, Fault fault) {
  const auto within = [&](Clock::Duration time) { return Deadline::after(clock, time); };
  const auto first = end.panel().wait_change({}, within(milliseconds(200)));
  if (!first) return {.told = first.error().message, .wrongs = {"the trial could not begin"}};
  const auto begun = clock.now();
  end.begin(fault);
  static const std::map<Fault, std::vector<ErrorCode>> named{
      {Fault::silent, {ErrorCode::timeout}},
      {Fault::late, {ErrorCode::timeout}},
      {Fault::damaged, {ErrorCode::protocol, ErrorCode::timeout}},
      {Fault::device_error, {ErrorCode::protocol, ErrorCode::io}},
      {Fault::unplugged, {ErrorCode::io}},
      {Fault::back_after_2s, {ErrorCode::io}},
      {Fault::earlier_answer, {ErrorCode::protocol}}};
  auto outcome = timed(clock, kLimit, named.at(fault), [&](Deadline by) -> Result<void> {
    if (method == "show") return end.panel().show(green(), by);
    const auto seen = end.panel().wait_change(*first, by);
    if (!seen) return pass_on(seen);
    return {};
  });
  if (method == "show" && outcome.told == "ok" && end.lamp()) {
    // The repeated request takes the earlier one's reply as its own; the requirement is that the lamp is on.
    outcome = {.told = "ok: sent again, and the lamp burns"};
  }
  if (fault == Fault::back_after_2s) clock.sleep_until(begun + kAbsence);
  end.end();
  // As in the daemon: a failed call is repeated, and the device reopened if that does not help.
  auto shown = end.panel().show(green(), within(kAmple));
  if (!shown && end.open()) shown = end.panel().show(green(), within(kAmple));
  outcome.expect(shown && end.lamp(), "the lamp does not burn afterwards");
  auto known = end.panel().wait_change({}, within(milliseconds(200)));
  end.press_start(true);
  bool seen = false;
  for (const auto by = within(kAmple); known && !seen && !by.expired(clock);) {
    known = end.panel().wait_change(*known, within(milliseconds(200)));
    seen = known && known->start;
  }
  outcome.expect(seen, "a press is not seen afterwards");
  return outcome;
}

std::optional<std::string> why_not(bool gpio, Fault fault) {
  if (fault == Fault::stalled) return "nothing moves";
  if (!gpio || fault == Fault::device_error || fault == Fault::unplugged || fault == Fault::back_after_2s) {
    return std::nullopt;
  }
  return "a GPIO line has no answers: the kernel obeys or refuses at once";
}

}  // namespace

std::vector<Cell> panel_cells(const std::filesystem::path& scratch) {
  std::vector<Cell> cells;
  for (const bool gpio : {true, false}) {
    for (const std::string method : {"wait_change", "show"}) {
      for (const auto& [fault, name] : kFaults) {
        cells.push_back(
            {gpio ? "GpioPanel" : "ModbusIoPanel", "", method, fault, [scratch, gpio, method, fault = fault] {
               if (auto reason = why_not(gpio, fault)) return not_applicable(*reason);
               RealClock clock;
               std::unique_ptr<PanelEnd> end;
               if (gpio) {
                 end = std::make_unique<GpioEnd>(scratch, clock);
               } else {
                 end = std::make_unique<ModuleEnd>(scratch, clock);
               }
               return trial(*end, clock, method, fault);
             }});
      }
    }
  }
  return cells;
}

}  // namespace scanrig::bench
