#include "daemon/api/admission.h"

#include <algorithm>
#include <utility>

namespace scanrig {
namespace {

constexpr std::size_t kMaxAccounts = 1024;  ///< then those with their full allowance again are dropped

}  // namespace

Admission::Admission(const ApiLimits& limits) : limits_(limits) {
  waiting_.max_seats = limits.waiting;
  local_waiting_.max_seats = limits.local_waiting;
  seats_.max_seats = limits.connections;
  local_seats_.max_seats = limits.local_connections;
  reserved_.max_seats = limits.reserved;
}

Admission::SeatPtr Admission::wait(Door door, const std::string& peer, OnEvicted on_evicted) {
  return enter(door == Door::local ? local_waiting_ : waiting_, peer, std::move(on_evicted), true);
}

Admission::SeatPtr Admission::enter(Door door, const std::string& peer, OnEvicted on_evicted) {
  return enter(door == Door::local ? local_seats_ : seats_, peer, std::move(on_evicted), false);
}

Admission::SeatPtr Admission::enter_reserved(const std::string& peer, OnEvicted on_evicted) {
  return enter(reserved_, peer, std::move(on_evicted), true);
}

Admission::SeatPtr Admission::enter(Pool& pool, const std::string& peer, OnEvicted on_evicted, bool always) {
  OnEvicted evicted;
  SeatPtr seat;
  {
    const std::lock_guard guard(mutex_);
    const auto counted = pool.by_peer.find(peer);
    const std::size_t held = counted == pool.by_peer.end() ? 0 : counted->second;
    if (!always && (held >= limits_.connections_a_peer || pool.max_seats == 0)) return nullptr;
    if (pool.taken.size() >= pool.max_seats && !pool.taken.empty()) {
      const auto place = oldest_of_largest(pool);
      if (!always && pool.by_peer.at(place->peer) < held + 2) return nullptr;
      evicted = std::move(place->on_evicted);
      remove(pool, place);
    }
    ++pool.by_peer[peer];
    pool.taken.push_back({++last_number_, peer, std::move(on_evicted)});
    seat = std::make_unique<Seat>(shared_from_this(), pool, peer, last_number_);
  }
  if (evicted) evicted();
  return seat;
}

/// An evicted one has left already.
void Admission::leave(Pool& pool, std::uint64_t number) {
  const std::lock_guard guard(mutex_);
  const auto place = std::ranges::find(pool.taken, number, &Taken::number);
  if (place != pool.taken.end()) remove(pool, place);
}

/// Where several peers have most, the oldest of all of theirs: a newcomer is never evicted first.
Admission::Places::iterator Admission::oldest_of_largest(Pool& pool) {
  std::size_t most = 0;
  for (const auto& [peer, count] : pool.by_peer) most = std::max(most, count);
  return std::ranges::find_if(pool.taken, [&](const Taken& taken) { return pool.by_peer.at(taken.peer) == most; });
}

void Admission::remove(Pool& pool, Places::iterator place) {
  const auto counted = pool.by_peer.find(place->peer);
  if (--counted->second == 0) pool.by_peer.erase(counted);
  pool.taken.erase(place);
}

bool Admission::take(const std::string& account, double price, Clock::time_point now) {
  const std::lock_guard guard(mutex_);
  if (accounts_.size() >= kMaxAccounts) forget_idle(now);
  auto& known = accounts_.try_emplace(account, Account{limits_.requests_at_once, now}).first->second;
  const auto later = std::max(now, known.counted);
  const std::chrono::duration<double> passed = later - known.counted;
  known.counted = later;
  known.requests = std::min(limits_.requests_at_once, known.requests + passed.count() * limits_.requests_a_second);
  const bool enough = known.requests >= 1.0;
  if (enough) known.requests = std::max(known.requests - price, 1.0 - limits_.price_of_a_bad_token);
  return enough;
}

void Admission::forget_idle(Clock::time_point now) {
  const auto refilled = std::chrono::duration<double>((limits_.requests_at_once + limits_.price_of_a_bad_token) /
                                                      limits_.requests_a_second);
  std::erase_if(accounts_, [&](const auto& account) { return now - account.second.counted > refilled; });
}

std::size_t Admission::connections() const {
  const std::lock_guard guard(mutex_);
  std::size_t all = 0;
  for (const auto* pool : {&waiting_, &local_waiting_, &seats_, &local_seats_, &reserved_}) all += pool->taken.size();
  return all;
}

}  // namespace scanrig
