#pragma once

#include <cstdint>
#include <memory>
#include <thread>

#include "core/result.h"
#include "sim/wire/lightcrafter.h"

namespace scanrig::sim::wire {

/// A LightCrafter at the end of a USB cable: descriptors, control and interrupt transfers over USB/IP
/// [Documentation/usb/usbip_protocol.rst of Linux], for a kernel with vhci-hcd: `usbip attach -r 127.0.0.1 -b 1-1`.
/// One kernel at a time. Threads: its own.
class UsbIpServer {
 public:
  static constexpr const char* kBusId = "1-1";

  /// Listens on 127.0.0.1. Fails with `io`.
  static Result<std::unique_ptr<UsbIpServer>> start(std::uint16_t port, LightCrafter& device);
  ~UsbIpServer();

 private:
  UsbIpServer(int listener, LightCrafter& device);
  void serve(const std::stop_token& stop);

  const int listener_;
  LightCrafter& device_;
  std::jthread thread_;
};

}  // namespace scanrig::sim::wire
