#include <atomic>
#include <optional>
#include <thread>

#include "drivers/projector/gpio_projector.h"
#include "sim/wire/gpio_socket.h"
#include "tests/bench/fault_matrix/cells.h"

namespace scanrig::bench {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLimit{1000};
constexpr milliseconds kPulse{200};
constexpr milliseconds kAbsence{2000};
constexpr const char* kLine = "PROJ_TRIG";

class Trial {
 public:
  explicit Trial(const std::filesystem::path& scratch) : socket_(fresh(scratch)) { plug_in(); }

  Outcome run(const std::string& method, Fault fault) {
    if (auto opened = open(); !opened) return {.told = opened.error().message, .wrongs = {"could not begin"}};
    Clock::TimePoint begun = clock_.now();
    std::jthread meanwhile;
    if (method == "dark") {
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
      return method == "dark" ? projector_->turn_off(by) : projector_->fire(Light::pattern, by);
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

std::optional<std::string> why_not(Fault fault) {
  if (fault == Fault::stalled) return "nothing moves";
  if (fault == Fault::device_error || fault == Fault::unplugged || fault == Fault::back_after_2s) return std::nullopt;
  return "a GPIO line has no answers: the kernel obeys or refuses at once";
}

}  // namespace

std::vector<Cell> projector_cells(const std::filesystem::path& scratch) {
  std::vector<Cell> cells;
  for (const std::string method : {"fire", "dark", "request_off"}) {
    for (const auto& [fault, name] : kFaults) {
      cells.push_back({"GpioProjector", "", method, fault, [scratch, method, fault] {
                         if (auto reason = why_not(fault)) return not_applicable(*reason);
                         return Trial(scratch).run(method, fault);
                       }});
      cells.push_back({"ManualProjector", "", method, fault,
                       [] { return not_applicable("has no wire: a hand switches the light"); }});
    }
  }
  return cells;
}

}  // namespace scanrig::bench
