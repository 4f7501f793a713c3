#pragma once

#include <memory>
#include <mutex>

#include "drivers/modbus/client.h"

namespace scanrig::modbus {

/// One device that two drivers of this process share, such as an I/O module that has buttons and the projector's
/// trigger. Threads: any; one request, or one group of requests, at a time.
class Bus {
 public:
  /// Returns the same Bus for the same port, as long as a driver holds it: a port has one master. `options` are those
  /// of the first caller.
  static std::shared_ptr<Bus> at(const ClientOptions& options, Clock& clock);

  /// Holds the bus until destroyed.
  class Turn {
   public:
    Client* operator->() const { return &bus_.line_; }

   private:
    friend Bus;
    explicit Turn(Bus& bus) : bus_(bus), lock_(bus.mutex_) {}
    Bus& bus_;
    std::unique_lock<std::mutex> lock_;
  };
  /// Waits for the other driver's requests, each of which has a deadline of its own.
  [[nodiscard]] Turn turn() { return Turn(*this); }

  [[nodiscard]] ClientStatistics statistics() {
    const std::scoped_lock lock(mutex_);
    return line_.statistics();
  }

 private:
  Bus(const ClientOptions& options, Clock& clock) : line_(options, clock) {}

  std::mutex mutex_;
  Client line_;
};

}  // namespace scanrig::modbus
