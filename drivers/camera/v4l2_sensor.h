#pragma once

#include <linux/videodev2.h>

#include <vector>

#include "drivers/camera/v4l2_stereo_camera.h"

namespace scanrig {

/// One V4L2 capture device, streaming into memory-mapped buffers. Stamps are the kernel's monotonic clock, which is the
/// host's; the id is the driver's sequence number.
class V4l2Sensor final : public Sensor {
 public:
  V4l2Sensor(const std::string& side, const V4l2SensorOptions& sensor, const V4l2Options& options, VideoCalls& calls,
             Clock& clock);
  ~V4l2Sensor() override { disconnect(); }

  [[nodiscard]] const std::string& name() const override { return name_; }
  Result<bool> prepare(Deadline deadline) override;
  Result<std::optional<SensorFrame>> next(Deadline deadline) override;
  [[nodiscard]] bool can_trigger() const override { return false; }
  [[nodiscard]] std::uint64_t id_ring() const override { return std::uint64_t{1} << 32; }
  [[nodiscard]] bool shares_host_clock() const override { return true; }
  Result<bool> listen_to_line(bool) override;
  Result<void> trigger() override;
  Result<void> scale_exposure(double factor, Deadline deadline) override;

 private:
  struct Wanted {
    std::uint32_t id;
    int value;
    std::string what;
    int tolerance = 0;
    bool must_exist = false;
  };
  struct Buffer {
    void* address;
    std::size_t length;
  };

  [[nodiscard]] Result<std::string> find_device() const;
  Result<void> connect();
  Result<void> set_format();
  Result<void> set_controls();
  [[nodiscard]] std::vector<Wanted> wanted_controls() const;
  Result<bool> set_control(const Wanted& wanted);
  Result<void> check_control(const Wanted& wanted);
  Result<void> start();
  void disconnect();
  Result<void> call(unsigned long request, void* argument, const char* what);
  [[nodiscard]] tl::unexpected<Error> failed(const std::string& what, int reason);
  Result<SensorFrame> read(const v4l2_buffer& buffer) const;

  const std::string name_;
  const V4l2SensorOptions sensor_;
  V4l2Options options_;  // with the exposure as it is scaled
  const std::chrono::microseconds configured_exposure_ = options_.exposure;
  VideoCalls& calls_;
  Clock& clock_;
  int descriptor_ = -1;
  bool lost_ = false;
  v4l2_pix_format format_{};
  std::vector<Buffer> buffers_;
};

}  // namespace scanrig
