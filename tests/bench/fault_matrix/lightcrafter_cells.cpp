#include <optional>
#include <thread>

#include "tests/bench/fault_matrix/cells.h"
#include "tests/component/lightcrafter/lightcrafter_bench.h"

namespace scanrig::bench {
namespace {

using std::chrono::milliseconds;
using DeviceFault = sim::wire::LightCrafter::Fault;

constexpr milliseconds kLimit{1000};
constexpr milliseconds kExposure{200};
constexpr milliseconds kAbsence{2000};

class LightCrafterTrial {
 public:
  Outcome run(const std::string& method, Fault fault) {
    if (auto fired = fire(); !fired) return {.told = fired.error().message, .wrongs = {"could not begin"}};
    const auto begun = clock().now();
    std::jthread meanwhile;
    if (method == "request_off") {
      meanwhile = std::jthread([&] {
        soon(clock(), kLimit, [&] { return bench_.device().lit(); });  // the fault occurs while the light is on
        begin(fault);
        bench_.projector().request_off();
      });
    } else {
      begin(fault);
    }
    auto outcome = timed(clock(), kLimit, named(method, fault), [&](Deadline by) {
      return method == "dark" ? bench_.projector().turn_off(by) : bench_.projector().fire(Light::pattern, by);
    });
    if (meanwhile.joinable()) meanwhile.join();
    if (fault == Fault::back_after_2s) clock().sleep_until(begun + kAbsence);
    end();
    auto fired = fire();
    if (!fired) fired = fire();  // as in the daemon
    outcome.expect(fired.has_value(), "does not fire afterwards");
    outcome.expect(!bench_.device().lit(), "is not dark afterwards");
    return outcome;
  }

 private:
  /// Errors that the call may end in; none: it still succeeds.
  static std::vector<ErrorCode> named(const std::string& method, Fault fault) {
    if (method == "request_off") return {ErrorCode::io};
    switch (fault) {
      case Fault::silent: return {ErrorCode::timeout};
      case Fault::damaged: return {ErrorCode::protocol};
      case Fault::device_error:
        if (method == "dark") return {};
        return {ErrorCode::device_alarm};
      case Fault::unplugged:
      case Fault::back_after_2s: return {ErrorCode::io};
      default: return {};
    }
  }
  void begin(Fault fault) {
    constexpr std::uint8_t kReset = 0x05;
    switch (fault) {
      case Fault::silent: return bench_.device().inject(DeviceFault::silent, 1);
      case Fault::damaged: return bench_.device().inject(DeviceFault::endless_reply, 1);
      case Fault::earlier_answer: return bench_.device().inject(DeviceFault::earlier_reply, 3);
      case Fault::device_error: return bench_.device().set_hardware_status(kReset);
      default: return bench_.plug(false);
    }
  }
  void end() {
    bench_.device().inject(DeviceFault::none, 0);
    bench_.device().set_hardware_status(0x01);
    bench_.plug(true);
  }
  Result<void> fire() { return bench_.projector().fire(Light::pattern, Deadline::after(clock(), kLimit)); }
  Clock& clock() { return bench_.clock(); }

  LightCrafterBench bench_{[](LightCrafterOptions& options) { options.exposure = kExposure; }};
};

std::optional<std::string> why_not(Fault fault) {
  if (fault == Fault::stalled) return "nothing moves";
  if (fault == Fault::late) return "a reply after its time-out is the answer of an earlier request: see there";
  return std::nullopt;
}

}  // namespace

std::vector<Cell> lightcrafter_cells() {
  std::vector<Cell> cells;
  for (const std::string method : {"fire", "dark", "request_off"}) {
    for (const auto& [fault, name] : kFaults) {
      cells.push_back({"LightCrafterProjector", "", method, fault, [method, fault = fault] {
                         if (auto reason = why_not(fault)) return not_applicable(*reason);
                         return LightCrafterTrial().run(method, fault);
                       }});
    }
  }
  return cells;
}

}  // namespace scanrig::bench
