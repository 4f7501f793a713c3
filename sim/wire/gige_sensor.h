#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "sim/wire/gige_camera.h"

struct _ArvBuffer;        // NOLINT: names of Aravis
struct _ArvFakeCamera;    // NOLINT
struct _ArvGvFakeCamera;  // NOLINT

namespace scanrig::sim::wire {

struct GigeSensorOptions {
  Side side = Side::left;
  std::string address, serial;
  cv::Size size;
  std::chrono::milliseconds late_by{0};
  std::string trigger_selector;
  std::chrono::nanoseconds clock_ahead{0};
  double clock_drift = 0.0;
  std::chrono::microseconds frame_after{0};
  std::function<bool(const GigeExposure&)> ready;
  bool numbered = true;
  GigeOutputs outputs = GigeOutputs::full;
  std::chrono::microseconds max_exposure{0};
};

/// One of GigeCameras: Aravis' GigE Vision camera on the wire with its own frames, ids and stamps. Line0 has the value
/// of Software in its GenICam description, and an edge writes the software trigger's register from within.
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

 private:
  struct Frame {
    std::uint16_t id = 0;
    std::chrono::nanoseconds stamp{0};
    GigeExposure exposure;
    GigeFault fault = GigeFault::none;
    Clock::TimePoint due;
  };

  GigeSensor(const GigeSensorOptions& options, FrameSource source, Clock& clock, std::string description);
  static void fill(_ArvBuffer* buffer, void* self, std::uint32_t exposure_us, std::uint32_t gain, std::uint32_t format);
  void fill(_ArvBuffer* buffer);
  void draw(const Frame& frame, cv::Mat& image) const;
  void send_frames(const std::stop_token& stop);
  Frame exposed_by_host();
  [[nodiscard]] Frame new_frame(const GigeExposure& exposure);
  [[nodiscard]] bool streaming() const;

  const GigeSensorOptions options_;
  const FrameSource source_;
  Clock& clock_;
  const std::string description_;  // file of the GenICam description
  const Clock::TimePoint started_;
  const int nudge_socket_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  _ArvGvFakeCamera* camera_ = nullptr;
  _ArvFakeCamera* core_ = nullptr;  // belongs to camera_
  std::uint16_t last_id_ = 65000;   // the ids wrap soon
  std::chrono::nanoseconds set_by_{0};
  std::deque<Frame> queue_;
  std::optional<Frame> triggered_;  // the frame of the last register write
  std::optional<Frame> last_;       // the frame before, for `stale`
  std::uint64_t by_software_ = 0;
  std::function<Strobe(int output)> on_strobe_;
  std::jthread sender_;
};

}  // namespace scanrig::sim::wire
