#pragma once

#include <netinet/in.h>

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/gige_registers.h"

namespace scanrig::sim::wire {

struct GigeWireOptions {
  std::string address, serial;
  std::string description;            ///< GenICam XML
  std::uint32_t packet_bytes = 1400;  ///< with IP and UDP headers; the host may change it
  std::uint32_t packet_delay_ns = 0;
};

/// One frame on its way to the host.
struct GigeBlock {
  std::uint16_t id = 0;
  std::uint64_t stamp_ns = 0;
  std::uint32_t pixel_format = 0;
  cv::Rect region;
  bool has_chunks = false;
  std::vector<std::uint8_t> bytes;
};

/// A GigE Vision device on UDP: its control channel with the bootstrap registers, and its stream channel, which sends
/// at the speed of a gigabit link [GigE Vision 1.2]. Packets are not sent again on request.
/// Threads: requests are handled on a thread of its own; send() from one at a time.
class GigeWire {
 public:
  struct Handlers {
    std::function<std::optional<std::uint32_t>(std::uint32_t address)> read;
    std::function<GvcpStatus(std::uint32_t address, std::uint32_t value)> write;
    std::function<bool()> is_acquiring;  ///< its packets keep their size then
    std::function<void()> on_abandoned;  ///< the controlling host is gone
  };

  /// Fails with `io` (the address or its port cannot be used).
  static Result<std::unique_ptr<GigeWire>> open(const GigeWireOptions& options, Handlers handlers, Clock& clock);
  ~GigeWire();

  /// True if a host has opened the stream channel.
  [[nodiscard]] bool is_open() const;
  /// Sends a frame; `lost_share` of its packets are lost on the way. Gives up when `stop` is requested.
  void send(const GigeBlock& block, double lost_share, const std::stop_token& stop);

 private:
  struct Request;
  GigeWire(const GigeWireOptions& options, Handlers handlers, Clock& clock);
  Result<void> bind_sockets();
  void fill_bootstrap();
  void serve(const std::stop_token& stop);
  void receive(int socket);
  void answer(const Request& request);
  void reply(const Request& request, std::uint16_t command, GvcpStatus status,
             std::span<const std::uint8_t> payload) const;
  void read_registers(const Request& request);
  void write_registers(const Request& request);
  void read_memory(const Request& request);
  void write_memory(const Request& request);
  [[nodiscard]] std::optional<std::uint32_t> read_word(std::uint32_t address) const;
  GvcpStatus write_word(const Request& request, std::uint32_t address, std::uint32_t value);
  GvcpStatus write_bootstrap(const Request& request, std::uint32_t address, std::uint32_t value);
  void abandon_if_silent();

  const GigeWireOptions options_;
  const Handlers handlers_;
  Clock& clock_;
  std::array<int, 3> control_{-1, -1, -1};  // its own address, and two to which discovery is broadcast
  int stream_ = -1;
  mutable std::mutex mutex_;  // the bootstrap registers and the controller
  std::vector<std::uint8_t> bootstrap_;
  std::optional<sockaddr_in> controller_;
  Clock::TimePoint last_request_{};
  std::mt19937 random_{1};
  std::jthread server_;
};

}  // namespace scanrig::sim::wire
