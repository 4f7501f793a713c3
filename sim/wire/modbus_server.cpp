#include "sim/wire/modbus_server.h"

#include <utility>

namespace scanrig::sim::wire {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFrameTimeout{20};  ///< a frame that pauses this long in the middle is dropped
constexpr std::uint8_t kWrongCrc = 8;      ///< Leadshine's reply to a damaged request
constexpr std::size_t kMaxRegisters = 125;
constexpr std::size_t kMaxBits = 2000;

}  // namespace

Result<std::unique_ptr<ModbusServer>> ModbusServer::start(std::filesystem::path link, std::uint8_t unit,
                                                          RegisterDevice& device, Clock& clock) {
  std::unique_ptr<ModbusServer> server(new ModbusServer(std::move(link), unit, device, clock));
  if (auto plugged = server->come_back(); !plugged) return pass_on(plugged);
  return server;
}

void ModbusServer::on_request(std::function<void(const ModbusRequest&)> listener) {
  const std::scoped_lock lock(listener_mutex_);
  listener_ = std::move(listener);
}

void ModbusServer::serve(const std::stop_token& stop, Pty& pty) {
  Bytes pending;
  while (!stop.stop_requested()) {
    const Bytes received = pty.read(kFrameTimeout);
    if (received.empty()) pending.clear();
    pending.insert(pending.end(), received.begin(), received.end());
    for (;;) {
      const auto length = request_length(pending);
      if (!length || pending.size() < *length) break;
      const auto end = pending.begin() + static_cast<std::ptrdiff_t>(*length);
      const Bytes frame(pending.begin(), end);
      pending.erase(pending.begin(), end);
      handle(stop, pty, frame);
    }
  }
}

void ModbusServer::handle(const std::stop_token& stop, Pty& pty, const Bytes& frame) {
  note(true, frame);
  if (frame[0] != unit_) return;
  const auto fault = next_fault(frame[1]);
  using Kind = WireFault::Kind;
  if (fault && fault->kind == Kind::request_lost) return;
  const bool obey = !fault || fault->kind != Kind::refuse;
  send(stop, pty, carry_out(frame, obey, fault ? fault->exception : std::uint8_t{0}), fault);
}

Bytes ModbusServer::carry_out(const Bytes& frame, bool obey, std::uint8_t exception) {
  if (!crc_fits(frame)) return exception_answer(frame[0], frame[1], kWrongCrc);
  const auto request = parse_request(frame);
  if (!request || request->count > (request->of_bits() ? kMaxBits : kMaxRegisters))
    return exception_answer(frame[0], frame[1], kIllegalFunction);
  std::function<void(const ModbusRequest&)> listener;
  {
    const std::scoped_lock lock(listener_mutex_);
    listener = listener_;
  }
  if (listener) listener(*request);
  if (!obey) return exception_answer(frame[0], frame[1], exception);
  if (request->function <= 0x02) {
    std::vector<bool> bits(request->count);
    const std::uint8_t refused = device_.read_bits(request->function, request->address, bits);
    return refused != 0 ? exception_answer(frame[0], frame[1], refused) : bits_answer(*request, bits);
  }
  if (request->of_bits()) {
    const std::uint8_t refused = device_.write_coils(request->address, request->bits);
    return refused != 0 ? exception_answer(frame[0], frame[1], refused) : write_answer(*request);
  }
  if (request->function == 0x03) {
    std::vector<std::uint16_t> values(request->count);
    const std::uint8_t refused = device_.read(request->address, values);
    return refused != 0 ? exception_answer(frame[0], frame[1], refused) : read_answer(*request, values);
  }
  const std::uint8_t refused = device_.write(request->address, request->values);
  return refused != 0 ? exception_answer(frame[0], frame[1], refused) : write_answer(*request);
}

}  // namespace scanrig::sim::wire
