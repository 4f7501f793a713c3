#include <atomic>
#include <optional>
#include <thread>

#include "drivers/projector/gpio_projector.h"
#include "drivers/projector/modbus_io_projector.h"
#include "sim/wire/gpio_socket.h"
#include "sim/wire/modbus_io.h"
#include "sim/wire/modbus_server.h"
#include "tests/bench/fault_matrix/cells.h"

namespace scanrig::bench {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLimit{1000};
constexpr milliseconds kPulse{200};
constexpr milliseconds kAbsence{2000};
constexpr milliseconds kLate{60};
constexpr const char* kLine = "PROJ_TRIG";

class Trial {
 public:
  explicit Trial(const std::filesystem::path& scratch) : socket_(fresh(scratch)) { plug_in(); }

  Outcome run(const std::string& method, Fault fault) {
    if (auto opened = open(); !opened) return {.told = opened.error().message, .wrongs = {"could not begin"}};
    Clock::TimePoint begun = clock_.now();
    std::jthread meanwhile;
    if (method == "turn_off") {
      far_end_.reset();
    } else {
      meanwhile = std::jthread([&] {
        soon(clock_, kLimit, [&] { return far_end_->level(kLine); });  // the fault occurs while the light is on
        begun = clock_.now();
        far_end_.reset();
        if (method == "request_off") projector_->request_off();
      });
    }
    auto outcome = timed(clock_, kLimit, {ErrorCode::io}, [&](Deadline by) {
      return method == "turn_off" ? projector_->turn_off(by) : projector_->fire(Light::pattern, by);
    });
    if (meanwhile.joinable()) meanwhile.join();
    if (fault == Fault::back_after_2s) clock_.sleep_until(begun + kAbsence);
    plug_in();
    // As in the daemon: the device is used again, and reopened if that does not help.
    auto fired = fire();
    if (!fired && open()) fired = fire();
    outcome.expect(fired.has_value(), "does not fire afterwards");
    outcome.expect(!far_end_->level(kLine), "is not dark afterwards");
    return outcome;
  }

 private:
  static std::filesystem::path fresh(const std::filesystem::path& scratch) {
    static std::atomic<int> count = 0;
    return scratch / fmt::format("light{}", count++);
  }
  void plug_in() { far_end_ = sim::wire::GpioSocket::start(socket_, {{kLine, false}}, clock_).value(); }
  Result<void> fire() { return projector_->fire(Light::pattern, Deadline::after(clock_, kLimit)); }
  Result<void> open() {
    projector_.reset();
    auto projector = GpioProjector::open({.pattern_line = {kLine}, .plain_line = {}, .pulse = kPulse}, *lines_, clock_);
    if (!projector) return pass_on(projector);
    projector_ = std::move(*projector);
    return {};
  }

  RealClock clock_;
  const std::filesystem::path socket_;
  std::unique_ptr<sim::wire::GpioSocket> far_end_;
  std::unique_ptr<gpio::Lines> lines_ = gpio::socket_lines(socket_, clock_);
  std::unique_ptr<GpioProjector> projector_;
};

/// The light on an output of a Modbus I/O module.
class ModuleTrial {
 public:
  explicit ModuleTrial(const std::filesystem::path& scratch) : port_(fresh(scratch)) {
    server_ = sim::wire::ModbusServer::start(port_, kUnit, module_, clock_).value();
    open();
  }

  Outcome run(const std::string& method, Fault fault) {
    Clock::TimePoint begun = clock_.now();
    std::jthread meanwhile;
    if (method == "turn_off") {
      begin(fault);
    } else {
      meanwhile = std::jthread([&] {
        soon(clock_, kLimit, [&] { return module_.coil(0); });  // the fault occurs while the light is on
        begun = clock_.now();
        begin(fault);
        if (method == "request_off") projector_->request_off();
      });
    }
    bool dark_in_time = false;
    auto outcome = timed(clock_, kLimit, codes(fault), [&](Deadline by) {
      auto done = method == "turn_off" ? projector_->turn_off(by) : projector_->fire(Light::pattern, by);
      dark_in_time = !module_.coil(0);
      return done;
    });
    if (meanwhile.joinable()) meanwhile.join();
    if (outcome.told == "ok" && dark_in_time) outcome = {.told = "ok: sent again, and it is dark"};
    if (fault == Fault::back_after_2s) clock_.sleep_until(begun + kAbsence);
    server_->clear_faults();
    std::ignore = server_->come_back();
    auto fired = fire();
    if (!fired) {
      open();
      fired = fire();
    }
    outcome.expect(fired.has_value(), "does not fire afterwards");
    outcome.expect(!module_.coil(0), "is not dark afterwards");
    return outcome;
  }

 private:
  static constexpr int kUnit = 2;
  static std::filesystem::path fresh(const std::filesystem::path& scratch) {
    static std::atomic<int> count = 0;
    return scratch / fmt::format("output{}", count++);
  }
  /// A request may be sent again once: two faults in a row are seen.
  void begin(Fault fault) {
    using Kind = sim::wire::WireFault::Kind;
    const auto twice = [this](const sim::wire::WireFault& one) {
      server_->inject(one);
      server_->inject(one);
    };
    switch (fault) {
      case Fault::silent: return twice({.kind = Kind::request_lost});
      case Fault::late: return twice({.kind = Kind::late, .delay = kLate});
      case Fault::damaged: return twice({.kind = Kind::wrong_crc});
      case Fault::earlier_answer: return twice({.kind = Kind::earlier_reply});
      case Fault::device_error: return twice({.kind = Kind::refuse});
      case Fault::stalled: return;
      case Fault::unplugged:
      case Fault::back_after_2s: return server_->vanish();
    }
  }
  static std::vector<ErrorCode> codes(Fault fault) {
    std::vector<ErrorCode> codes{ErrorCode::io};  // also of a pulse that request_off() ended
    if (fault == Fault::silent || fault == Fault::late || fault == Fault::damaged) codes.push_back(ErrorCode::timeout);
    if (fault == Fault::damaged || fault == Fault::earlier_answer || fault == Fault::device_error) {
      codes.push_back(ErrorCode::protocol);
    }
    return codes;
  }
  Result<void> fire() { return projector_->fire(Light::pattern, Deadline::after(clock_, kLimit)); }
  void open() {
    projector_.reset();
    ModbusIoProjectorOptions options;
    options.line.device = port_;
    options.line.unit_id = kUnit;
    options.line.reply_timeout = milliseconds(30);
    options.pulse = kPulse;
    projector_ = std::make_unique<ModbusIoProjector>(options, clock_);
  }

  RealClock clock_;
  const std::filesystem::path port_;
  sim::wire::ModbusIoModule module_{8, 8};
  std::unique_ptr<sim::wire::ModbusServer> server_;
  std::unique_ptr<ModbusIoProjector> projector_;
};

std::optional<std::string> why_not(Fault fault) {
  if (fault == Fault::stalled) return "nothing moves";
  if (fault == Fault::device_error || fault == Fault::unplugged || fault == Fault::back_after_2s) return std::nullopt;
  return "a GPIO line has no answers: the kernel obeys or refuses at once";
}

}  // namespace

std::vector<Cell> projector_cells(const std::filesystem::path& scratch) {
  std::vector<Cell> cells;
  for (const std::string method : {"fire", "turn_off", "request_off"}) {
    for (const auto& [fault, name] : kFaults) {
      cells.push_back({"GpioProjector", "", method, fault, [scratch, method, fault = fault] {
                         if (auto reason = why_not(fault)) return not_applicable(*reason);
                         return Trial(scratch).run(method, fault);
                       }});
      cells.push_back({"ModbusIoProjector", "", method, fault, [scratch, method, fault = fault] {
                         if (fault == Fault::stalled) return not_applicable("nothing moves");
                         return ModuleTrial(scratch).run(method, fault);
                       }});
      cells.push_back({"ManualProjector", "", method, fault,
                       [] { return not_applicable("has no wire: a hand switches the light"); }});
    }
  }
  return cells;
}

}  // namespace scanrig::bench
