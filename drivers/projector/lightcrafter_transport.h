#pragma once

#include <functional>
#include <memory>

#include "core/clock.h"
#include "drivers/projector/lightcrafter_packets.h"

namespace scanrig::dlpc350 {

/// Carries reports to and from one device.
/// Threads: one owner.
class Transport {
 public:
  virtual ~Transport() = default;
  /// Fail with `timeout`, `io` (the device is gone).
  virtual Result<void> send(const Report& report, Deadline deadline) = 0;
  virtual Result<Report> receive(Deadline deadline) = 0;
};

/// Opens a transport, and again after the device was lost. Fails with `not_found`, `io`.
using OpenTransport = std::function<Result<std::unique_ptr<Transport>>()>;

/// The LightCrafter 4500 on USB with this serial number; the only one connected when `serial` is empty.
OpenTransport usb_transport(std::string serial, Clock& clock);

}  // namespace scanrig::dlpc350
