#include "sim/wire/modbus_server.h"

#include <utility>

namespace scanrig::sim::wire {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{20};  ///< a frame that stops this long in the middle is dropped
constexpr std::uint8_t kIllegalFunction = 1;
constexpr std::uint8_t kWrongCrc = 8;  ///< Leadshine's answer to a damaged request
constexpr std::size_t kMaxRegisters = 125;
constexpr std::size_t kMaxBits = 2000;

}  // namespace

Result<std::unique_ptr<ModbusServer>> ModbusServer::start(std::filesystem::path link, std::uint8_t unit,
                                                          RegisterDevice& device, Clock& clock) {
  std::unique_ptr<ModbusServer> server(new ModbusServer(std::move(link), unit, device, clock));
  if (auto plugged = server->come_back(); !plugged) return pass_on(plugged);
  return server;
}

ModbusServer::~ModbusServer() { vanish(); }

void ModbusServer::vanish() {
  const std::scoped_lock lock(port_mutex_);
  thread_ = {};
  pty_.reset();
}

Result<void> ModbusServer::come_back() {
  const std::scoped_lock lock(port_mutex_);
  if (pty_) return {};
  auto pty = Pty::open(link_);
  if (!pty) return pass_on(pty);
  pty_.emplace(std::move(*pty));
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop, *pty_); });
  return {};
}

void ModbusServer::inject(const WireFault& fault) {
  const std::scoped_lock lock(mutex_);
  faults_.push_back(fault);
}

void ModbusServer::clear_faults() {
  const std::scoped_lock lock(mutex_);
  faults_.clear();
}

std::vector<WireFrame> ModbusServer::log() const {
  const std::scoped_lock lock(mutex_);
  return log_;
}

void ModbusServer::clear_log() {
  const std::scoped_lock lock(mutex_);
  log_.clear();
}

void ModbusServer::on_request(std::function<void(const ModbusRequest&)> listener) {
  const std::scoped_lock lock(mutex_);
  listener_ = std::move(listener);
}

void ModbusServer::note(bool from_master, const Bytes& bytes) {
  const std::scoped_lock lock(mutex_);
  log_.push_back({clock_.now(), from_master, bytes});
}

std::optional<WireFault> ModbusServer::next_fault(std::uint8_t function) {
  const std::scoped_lock lock(mutex_);
  for (auto fault = faults_.begin(); fault != faults_.end(); ++fault) {
    if (fault->function && *fault->function != function) continue;
    const WireFault found = *fault;
    if (fault->count > 0 && --fault->count == 0) faults_.erase(fault);
    return found;
  }
  return std::nullopt;
}

void ModbusServer::serve(const std::stop_token& stop, Pty& pty) {
  Bytes pending;
  while (!stop.stop_requested()) {
    const Bytes heard = pty.read(kPatience);
    if (heard.empty()) pending.clear();
    pending.insert(pending.end(), heard.begin(), heard.end());
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
  if (fault && fault->kind == Kind::deaf) return;

  Bytes answer = carry_out(frame, !fault || fault->kind != Kind::refuse, fault ? fault->exception : std::uint8_t{0});
  const Bytes good = answer;
  if (fault) {
    switch (fault->kind) {
      case Kind::answer_lost: answer.clear(); break;
      case Kind::wrong_crc: answer.back() ^= 0x5A; break;
      case Kind::cut_short: answer.resize(answer.size() / 2); break;
      case Kind::earlier_answer: answer = last_answer_; break;
      case Kind::late: {
        // In slices, so that the adapter can be pulled meanwhile.
        for (const auto at = clock_.now() + fault->delay; clock_.now() < at && !stop.stop_requested();) {
          clock_.sleep_for(std::min<Clock::Duration>(at - clock_.now(), milliseconds(5)));
        }
        break;
      }
      case Kind::deaf:
      case Kind::refuse: break;
    }
  }
  last_answer_ = good;
  if (answer.empty()) return;
  note(false, answer);
  pty.write(answer);
}

Bytes ModbusServer::carry_out(const Bytes& frame, bool obey, std::uint8_t exception) {
  if (!crc_fits(frame)) return exception_answer(frame[0], frame[1], kWrongCrc);
  const auto request = parse_request(frame);
  if (!request || request->count > (request->of_bits() ? kMaxBits : kMaxRegisters))
    return exception_answer(frame[0], frame[1], kIllegalFunction);
  std::function<void(const ModbusRequest&)> listener;
  {
    const std::scoped_lock lock(mutex_);
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
