#include "sim/wire/wire_server.h"

#include <algorithm>
#include <utility>

namespace scanrig::sim::wire {

using std::chrono::milliseconds;

void WireServer::vanish() {
  const std::scoped_lock lock(port_mutex_);
  thread_ = {};
  pty_.reset();
}

Result<void> WireServer::come_back() {
  const std::scoped_lock lock(port_mutex_);
  if (pty_) return {};
  auto pty = Pty::open(link_);
  if (!pty) return pass_on(pty);
  pty_.emplace(std::move(*pty));
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop, *pty_); });
  return {};
}

void WireServer::inject(const WireFault& fault) {
  const std::scoped_lock lock(mutex_);
  faults_.push_back(fault);
}

void WireServer::clear_faults() {
  const std::scoped_lock lock(mutex_);
  faults_.clear();
}

void WireServer::set_line(const LineSettings& settings) {
  const std::scoped_lock lock(mutex_);
  line_ = settings;
}

std::vector<WireFrame> WireServer::log() const {
  const std::scoped_lock lock(mutex_);
  return log_;
}

void WireServer::clear_log() {
  const std::scoped_lock lock(mutex_);
  log_.clear();
}

void WireServer::note(bool from_master, const Bytes& bytes) {
  const std::scoped_lock lock(mutex_);
  log_.push_back({clock_.now(), from_master, bytes});
}

std::optional<WireFault> WireServer::next_fault(std::uint8_t function) {
  const std::scoped_lock lock(mutex_);
  // A client with other settings sends only noise.
  if (const auto client = line_ ? line_settings(link_) : std::nullopt; client && *client != *line_) {
    return WireFault{.kind = WireFault::Kind::request_lost};
  }
  for (auto fault = faults_.begin(); fault != faults_.end(); ++fault) {
    if (fault->function && *fault->function != function) continue;
    const WireFault found = *fault;
    if (fault->count > 0 && --fault->count == 0) faults_.erase(fault);
    return found;
  }
  return std::nullopt;
}

void WireServer::send(const std::stop_token& stop, Pty& pty, Bytes reply, const std::optional<WireFault>& fault) {
  using Kind = WireFault::Kind;
  const Bytes good = reply;
  if (fault && !reply.empty()) {
    switch (fault->kind) {
      case Kind::request_lost:
      case Kind::reply_lost: reply.clear(); break;
      case Kind::wrong_crc: reply[reply.size() - 1 - reply.size() / 4] ^= 0x9A; break;
      case Kind::cut_short: reply.resize(reply.size() / 2); break;
      case Kind::earlier_reply: reply = last_reply_; break;
      case Kind::late: {
        // In slices, so that the adapter can be pulled meanwhile.
        for (const auto at = clock_.now() + fault->delay; clock_.now() < at && !stop.stop_requested();) {
          clock_.sleep_for(std::min<Clock::Duration>(at - clock_.now(), milliseconds(5)));
        }
        break;
      }
      case Kind::refuse: break;
    }
  }
  last_reply_ = good;
  if (reply.empty()) return;
  note(false, reply);
  pty.write(reply);
}

}  // namespace scanrig::sim::wire
