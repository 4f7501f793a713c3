#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "sim/wire/gige_camera.h"
#include "sim/wire/gige_wire.h"

namespace scanrig::sim::wire {

struct GigeSensorOptions {
  Side side = Side::left;
  std::string address, serial;
  GigeModel model;
  std::chrono::microseconds nominal_exposure{0};
  std::chrono::milliseconds late_by{0};
  std::chrono::nanoseconds clock_ahead{0};
  double clock_drift = 0.0;
  std::chrono::microseconds frame_after{0};
  std::function<bool(const GigeExposure&)> ready;
  bool numbered = true;
};

/// One of GigeCameras: a GigE Vision camera on the wire with its own frames, ids and stamps. Ids restart with every
/// acquisition.
class GigeSensor {
 public:
  static Result<std::unique_ptr<GigeSensor>> start(const GigeSensorOptions& options, FrameSource source, Clock& clock);
  ~GigeSensor();

  void expose(const GigeExposure& exposure, GigeFault fault);
  Result<void> plug(bool in);
  void set_clock(std::chrono::nanoseconds by);

  /// An exposure that an output has shown to the other camera.
  struct Strobe {
    GigeExposure exposure;
    GigeFault fault = GigeFault::none;
  };
  /// Called from the camera's thread at each exposure by software during which an output is active, with its number.
  void on_strobe(std::function<Strobe(int output)> act);
  /// Number of the output that is active while it exposes; nothing while it is unplugged.
  [[nodiscard]] std::optional<int> output() const;
  [[nodiscard]] std::chrono::microseconds exposure_time() const;
  /// Value of a feature as text, for tests.
  [[nodiscard]] std::string value(const std::string& feature) const;

 private:
  struct Frame {
    std::uint16_t id = 0;
    std::chrono::nanoseconds stamp{0};
    GigeExposure exposure;
    GigeFault fault = GigeFault::none;
    Clock::TimePoint due;
    bool is_by_edge = false;  // its image has to be ready
  };

  GigeSensor(const GigeSensorOptions& options, FrameSource source, Clock& clock);
  GvcpStatus write(std::uint32_t address, std::uint32_t value);
  void expose_by_software();
  void stop_acquiring();
  void draw(const Frame& frame, cv::Mat& image) const;
  void send(const Frame& frame, const std::stop_token& stop);
  void send_frames(const std::stop_token& stop);
  void run_freely();
  [[nodiscard]] bool streaming() const;
  [[nodiscard]] bool waits_for(const std::string& source) const;
  [[nodiscard]] bool runs_freely() const;
  [[nodiscard]] std::size_t frame_trigger() const;
  [[nodiscard]] std::optional<int> active_output() const;
  [[nodiscard]] Frame new_frame(const GigeExposure& exposure);

  const GigeSensorOptions options_;
  const FrameSource source_;
  Clock& clock_;
  const Clock::TimePoint started_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  GigeRegisters registers_;
  std::shared_ptr<GigeWire> wire_;  // nothing while it is unplugged
  std::uint16_t last_id_ = 0;
  std::chrono::nanoseconds set_by_{0};
  std::deque<Frame> queue_;
  std::optional<Frame> last_;  // the frame before, for `stale`
  Clock::TimePoint busy_until_{}, next_free_{};
  std::uint64_t by_software_ = 0;
  std::function<Strobe(int output)> on_strobe_;
  std::jthread sender_;
};

}  // namespace scanrig::sim::wire
