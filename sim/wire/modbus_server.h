#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/modbus_frame.h"
#include "sim/wire/pty.h"

namespace scanrig::sim::wire {

/// A device behind the server. A non-zero exception code refuses.
/// Threads: any.
class RegisterDevice {
 public:
  virtual ~RegisterDevice() = default;
  /// Fills `values`; returns 0 or a Modbus exception code.
  virtual std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) = 0;
  virtual std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) = 0;
  /// The same for bits: `function` 1 reads coils, 2 discrete inputs. Without them: illegal function.
  virtual std::uint8_t read_bits(std::uint8_t /*function*/, std::uint16_t /*address*/, std::vector<bool>& /*bits*/) {
    return 1;
  }
  virtual std::uint8_t write_coils(std::uint16_t /*address*/, const std::vector<bool>& /*bits*/) { return 1; }
};

/// A way to misbehave towards the next requests.
struct WireFault {
  enum class Kind {
    deaf,           ///< does not hear the request
    answer_lost,    ///< obeys, its answer is lost
    late,           ///< obeys, answers `delay` later; meanwhile it hears nothing else
    wrong_crc,      ///< obeys, the answer is damaged
    cut_short,      ///< obeys, half of the answer arrives
    refuse,         ///< does not obey, answers with `exception`
    earlier_answer  ///< obeys, repeats the answer it gave before
  };
  Kind kind = Kind::deaf;
  int count = -1;                          ///< requests to spoil; negative: all
  std::optional<std::uint8_t> function{};  ///< spoil only this function's requests
  std::chrono::milliseconds delay{0};
  std::uint8_t exception = 4;
};

/// One frame, as it passed the far end of the wire.
struct WireFrame {
  Clock::TimePoint at;
  bool from_master = false;
  Bytes bytes;
};

/// A Modbus RTU device on a pseudo-terminal, in a thread of its own. The device's state changes before it answers.
/// Threads: every function may be called from any thread.
class ModbusServer {
 public:
  /// `link`: the name a driver opens. Fails with `io`.
  static Result<std::unique_ptr<ModbusServer>> start(std::filesystem::path link, std::uint8_t unit,
                                                     RegisterDevice& device, Clock& clock);
  ~ModbusServer();

  void inject(const WireFault& fault);
  void clear_faults();
  /// Pulls the adapter, and plugs it in again (fails with `io`).
  void vanish();
  Result<void> come_back();

  [[nodiscard]] std::vector<WireFrame> log() const;
  void clear_log();
  /// Called with every request that was heard, before it is carried out; from the server's thread.
  void on_request(std::function<void(const ModbusRequest&)> listener);

 private:
  ModbusServer(std::filesystem::path link, std::uint8_t unit, RegisterDevice& device, Clock& clock)
      : link_(std::move(link)), unit_(unit), device_(device), clock_(clock) {}

  void serve(const std::stop_token& stop, Pty& pty);
  void handle(const std::stop_token& stop, Pty& pty, const Bytes& frame);
  Bytes carry_out(const Bytes& frame, bool obey, std::uint8_t exception);
  std::optional<WireFault> next_fault(std::uint8_t function);
  void note(bool from_master, const Bytes& bytes);

  const std::filesystem::path link_;
  const std::uint8_t unit_;
  RegisterDevice& device_;
  Clock& clock_;

  mutable std::mutex mutex_;
  std::deque<WireFault> faults_;
  std::vector<WireFrame> log_;
  std::function<void(const ModbusRequest&)> listener_;
  Bytes last_answer_;  // server's thread only

  std::mutex port_mutex_;
  std::optional<Pty> pty_;
  std::jthread thread_;
};

}  // namespace scanrig::sim::wire
