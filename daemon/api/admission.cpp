#include "daemon/api/admission.h"

#include <algorithm>

namespace scanrig {
namespace {

constexpr std::size_t kMaxPeers = 1024;     ///< remembered
constexpr std::size_t kMaxTurnedAway = 32;  ///< at once: they cost descriptors, which the rest of the daemon needs
constexpr const char* kTurnedAway = "turned away";

}  // namespace

std::unique_ptr<Admission::Seat> Admission::enter(const std::string& peer) {
  const std::lock_guard guard(mutex_);
  if (connections_ >= limits_.connections) return nullptr;
  if (peers_.size() >= kMaxPeers) forget_idle(Clock::now());
  auto& known =
      peers_.try_emplace(peer, Peer{.requests = limits_.requests_at_once, .counted = Clock::now()}).first->second;
  if (known.connections >= limits_.connections_a_peer) return nullptr;
  ++known.connections;
  ++connections_;
  return std::make_unique<Seat>(shared_from_this(), peer);
}

std::unique_ptr<Admission::Seat> Admission::enter_to_be_turned_away() {
  const std::lock_guard guard(mutex_);
  auto& door = peers_[kTurnedAway];
  if (door.connections >= kMaxTurnedAway) return nullptr;
  ++door.connections;
  ++connections_;
  return std::make_unique<Seat>(shared_from_this(), kTurnedAway);
}

/// The peer stays known, or hanging up would buy new requests.
void Admission::leave(const std::string& peer) {
  const std::lock_guard guard(mutex_);
  --connections_;
  --peers_.at(peer).connections;
}

bool Admission::take(const std::string& peer, double price, Clock::time_point now) {
  const std::lock_guard guard(mutex_);
  auto& known = peers_.at(peer);
  const auto later = std::max(now, known.counted);
  const std::chrono::duration<double> passed = later - known.counted;
  known.counted = later;
  known.requests = std::min(limits_.requests_at_once, known.requests + passed.count() * limits_.requests_a_second);
  const bool enough = known.requests >= 1.0;
  if (enough) known.requests = std::max(known.requests - price, 1.0 - limits_.price_of_a_bad_token);
  return enough;
}

void Admission::forget_idle(Clock::time_point now) {
  const auto refilled = std::chrono::duration<double>(limits_.requests_at_once / limits_.requests_a_second);
  std::erase_if(peers_,
                [&](const auto& peer) { return peer.second.connections == 0 && now - peer.second.counted > refilled; });
}

std::size_t Admission::connections() const {
  const std::lock_guard guard(mutex_);
  return connections_;
}

}  // namespace scanrig
