#include <map>
#include <mutex>

#include "tests/bench/fault_matrix/cells.h"
#include "tests/component/camera/strobe_bench.h"
#include "tests/component/camera/v4l2_bench.h"

namespace scanrig::bench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Spoil = StereoCameraBench::Fault;

constexpr milliseconds kFrameLimit{1000};
constexpr seconds kConnectLimit{10};
constexpr milliseconds kNoticed{3100};  ///< a camera is checked when it was silent for three seconds
constexpr seconds kAbsence{2};

std::unique_ptr<StereoCameraBench> make_bench(const std::string& device) {
  if (device == "aravis") return std::make_unique<AravisBench>();
  return std::make_unique<V4l2Bench>(device == "v4l2-side-by-side");
}

/// One method of a camera under one fault, and good exposures afterwards: never frames of an earlier edge.
class CameraTrial {
 public:
  explicit CameraTrial(const std::string& device) : device_(device), bench_(make_bench(device)) {}

  Outcome run(const std::string& method, Fault fault) {
    if (auto good = expose(); !good) return {.told = good.error().message, .wrongs = {"could not begin"}};
    const bool absent = fault == Fault::unplugged || fault == Fault::back_after_2s;
    auto outcome = absent ? run_absent(method, fault) : run_spoilt(fault);
    for (int i = 0; i < 3; ++i) {
      const auto good = expose();
      outcome.expect(good.has_value(), good ? "" : "no good exposure afterwards: " + good.error().message);
      outcome.expect(!good || *good, "a frame of another edge was handed out");
      outcome.wrong_position |= good && !*good;
    }
    return outcome;
  }

 private:
  Outcome run_spoilt(Fault fault) {
    static const std::map<Fault, std::pair<Spoil, ErrorCode>> kSpoils{
        {Fault::silent, {Spoil::lost, ErrorCode::timeout}},
        {Fault::late, {Spoil::late, ErrorCode::timeout}},
        {Fault::damaged, {Spoil::torn, ErrorCode::protocol}},
        {Fault::earlier_answer, {Spoil::stale, ErrorCode::protocol}}};
    const auto& [spoil, code] = kSpoils.at(fault);
    if (auto armed = camera().arm(ample()); !armed) return {.told = armed.error().message, .wrongs = {"not armed"}};
    bench_->spoil(spoil);
    bench_->fire();
    return timed(clock(), kFrameLimit, {code}, [&](Deadline by) { return ended(camera().collect(by)); });
  }

  Outcome run_absent(const std::string& method, Fault fault) {
    const bool collects = method == "collect";
    if (collects) std::ignore = camera().arm(ample());
    const auto begun = clock().now();
    bench_->plug(false);
    // The driver detects the silence itself: there is no event to wait for.
    if (method == "prepare" || method == "arm") clock().sleep_for(kNoticed);
    if (collects) bench_->fire();
    auto outcome = timed(clock(), collects ? Clock::Duration(kFrameLimit) : kConnectLimit,
                         {ErrorCode::io, ErrorCode::timeout, ErrorCode::not_found}, [&](Deadline by) -> Result<void> {
                           if (method == "prepare") return camera().prepare(by);
                           if (method == "arm") return camera().arm(by);
                           return ended(collects ? camera().collect(by) : camera().capture_preview(by));
                         });
    if (fault == Fault::back_after_2s) clock().sleep_until(begun + kAbsence);
    outcome.expect(bench_->plug(true), "the bench cannot plug it in");
    return outcome;
  }

  static Result<void> ended(const Result<StereoFrame>& frame) {
    if (!frame) return pass_on(frame);
    return {};
  }
  /// False if another edge's frames were returned. A failed exposure is retaken, as in the daemon.
  Result<bool> expose() {
    Result<bool> last = false;
    for (int i = 0; i < 4; ++i) {
      last = expose_once();
      if (last) return last;
    }
    return last;
  }
  Result<bool> expose_once() {
    if (auto armed = camera().arm(ample()); !armed) return pass_on(armed);
    const auto number = bench_->fire();
    const auto frame = camera().collect(ample());
    if (!frame) return pass_on(frame);
    return bench_->number_in(frame->left) == number && bench_->number_in(frame->right) == number;
  }
  StereoCamera& camera() { return bench_->camera(); }
  Clock& clock() { return bench_->clock(); }
  Deadline ample() { return Deadline::after(clock(), seconds(10)); }

  const std::string device_;
  std::unique_ptr<StereoCameraBench> bench_;
};

/// The light that a GigE camera switches: its wire is that camera's control channel.
class StrobeTrial {
 public:
  Outcome run(const std::string& method, Fault fault) {
    if (auto good = expose(); !good) return {.told = good.error().message, .wrongs = {"could not begin"}};
    const auto begun = bench_.clock().now();
    disturb(fault, true);
    auto outcome = timed(bench_.clock(), kLimit, {ErrorCode::io, ErrorCode::timeout}, [&](Deadline by) {
      return method == "fire" ? bench_.projector().fire(Light::pattern, by) : bench_.projector().turn_off(by);
    });
    if (fault == Fault::back_after_2s) bench_.clock().sleep_until(begun + kAbsence);
    disturb(fault, false);
    const bool lights_again = soon(bench_.clock(), kRecovery, [&] { return expose().has_value(); });
    outcome.expect(lights_again, "no good exposure afterwards");
    outcome.expect(!bench_.is_lit(), "the light is on");
    return outcome;
  }

 private:
  static constexpr milliseconds kLimit{1500};
  static constexpr seconds kRecovery{20};

  void disturb(Fault fault, bool begins) {
    if (fault == Fault::silent) {
      bench_.far().freeze(begins);
    } else {
      bench_.tell(begins ? "plug left 0" : "plug left 1");
    }
  }
  Result<void> expose() {
    const auto ample = Deadline::after(bench_.clock(), seconds(10));
    if (auto armed = bench_.camera().arm(ample); !armed) return armed;
    if (auto fired = bench_.projector().fire(Light::pattern, ample); !fired) return fired;
    if (const auto frame = bench_.camera().collect(ample); !frame) return pass_on(frame);
    return {};
  }

  StrobeBench bench_;
};

std::optional<std::string> why_the_light_cannot(const std::string& method, Fault fault) {
  if (fault == Fault::stalled) return "nothing moves";
  if (method == "request_off") return "sends nothing";
  if (fault == Fault::silent || fault == Fault::unplugged || fault == Fault::back_after_2s) return std::nullopt;
  return "the camera's control channel repeats and checks by itself";
}

std::optional<std::string> why_not(const std::string& device, const std::string& method, Fault fault) {
  if (fault == Fault::stalled) return "nothing moves";
  if (fault == Fault::device_error) return "a camera raises no alarm";
  if (method == "capture_preview" && device != "aravis") return "exposes at the edge of its trigger input only";
  if (fault == Fault::unplugged || fault == Fault::back_after_2s || method == "collect") return std::nullopt;
  return method == "capture_preview" ? "frames are damaged at edges only: see collect" : "brings no frame";
}

}  // namespace

std::vector<Cell> camera_cells() {
  static std::mutex gige;  // all GigE cameras of a network share one port
  std::vector<Cell> cells;
  for (const std::string device : {"aravis", "v4l2", "v4l2-side-by-side"}) {
    for (const std::string method : {"prepare", "arm", "collect", "capture_preview"}) {
      for (const auto& [fault, name] : kFaults) {
        cells.push_back({"SensorCamera", device, method, fault, [device, method, fault = fault] {
                           if (auto reason = why_not(device, method, fault)) return not_applicable(*reason);
                           std::unique_lock lock(gige, std::defer_lock);
                           if (device == "aravis") lock.lock();
                           return CameraTrial(device).run(method, fault);
                         }});
      }
    }
  }
  for (const std::string method : {"fire", "turn_off", "request_off"}) {
    for (const auto& [fault, name] : kFaults) {
      cells.push_back({"CameraStrobeProjector", "", method, fault, [method, fault = fault] {
                         if (auto reason = why_the_light_cannot(method, fault)) return not_applicable(*reason);
                         const std::scoped_lock lock(gige);
                         return StrobeTrial().run(method, fault);
                       }});
    }
  }
  return cells;
}

}  // namespace scanrig::bench
