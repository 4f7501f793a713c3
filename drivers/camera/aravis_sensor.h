#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>

#include "drivers/camera/aravis_stereo_camera.h"
#include "drivers/camera/camera_strobe.h"
#include "drivers/camera/genicam_call.h"

namespace scanrig {

inline constexpr int kBuffers = 6;  // of each camera's stream

/// One GigE Vision or USB3 Vision camera.
class AravisSensor final : public Sensor, private CameraStrobe {
 public:
  AravisSensor(const std::string& side, const AravisSensorOptions& sensor, const AravisOptions& options, Clock& clock);
  ~AravisSensor() override;

  [[nodiscard]] const std::string& name() const override { return attempt_.who(); }
  Result<bool> prepare(Deadline deadline) override;
  Result<std::optional<SensorFrame>> next(Deadline deadline) override;
  [[nodiscard]] bool can_trigger() const override { return true; }
  [[nodiscard]] std::uint64_t id_ring() const override;
  [[nodiscard]] bool shares_host_clock() const override { return false; }
  Result<bool> listen_to_line(bool line) override;
  Result<void> trigger() override;
  Result<void> scale_exposure(double factor, Deadline deadline) override;
  [[nodiscard]] CameraStrobe* strobe() override { return options_.strobe_outputs.empty() ? nullptr : this; }

 private:
  Result<void> select_output(const std::string& output, Deadline deadline) override;
  Result<void> start_exposure(Deadline deadline) override;
  using Act = std::function<Result<void>(ArvCamera*)>;
  Result<void> request(const char* what, Act act, Deadline deadline);
  Result<void> connect(Deadline deadline);
  Result<void> start_stream();
  Result<void> start_acquisition();
  void stop_stream();
  Result<void> switch_source(const std::string& source);
  Result<void> let_go(Deadline deadline);
  Result<void> wait_for_pending(Deadline deadline);
  Result<SensorFrame> read(ArvBuffer* buffer) const;
  void ask_whether_there();

  const AravisSensorOptions sensor_;
  AravisOptions options_;  // with the exposure as it is scaled
  const std::chrono::microseconds configured_exposure_ = options_.exposure;
  Clock& clock_;
  const GenicamCall attempt_;
  GRef<ArvCamera> camera_;
  GRef<ArvStream> stream_;
  std::shared_future<Result<void>> pending_;  // a request of the lost connection that was not waited for
  std::future<void> giving_up_;               // ready when the last lost connection is given up
  std::optional<std::string> finding_;        // a problem of this machine's settings, see host_finding()
  std::shared_ptr<std::atomic<bool>> lost_ = std::make_shared<std::atomic<bool>>(false);  // a library's thread sets it
  Clock::TimePoint heard_{};                                                              // of the last reply or frame
  bool in_doubt_ = false;  // an expected frame did not come
  bool listens_to_line_ = true;
};

}  // namespace scanrig
