#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace scanrig {

/// Limits for one client, and for all of them together. A peer is a user of this machine, or an address.
struct ApiLimits {
  // A connection waits until its first request has shown its sender, then has a seat. Local connections have separate
  // waiting places and seats. All of them together stay well below the 1024 descriptors of a process.
  std::size_t waiting = 128, local_waiting = 64;
  std::size_t connections = 256, local_connections = 64;
  std::size_t connections_a_peer = 128;
  std::size_t reserved = 16;            ///< for Stop and status where no seat is free, each for one request
  double requests_a_second = 1000.0;    ///< per peer, on average
  double requests_at_once = 1000.0;     ///< per peer, after a pause
  double price_of_a_bad_token = 100.0;  ///< in requests: 10 guesses a second
  double price_of_an_order = 50.0;      ///< from a browser, in requests: 20 a second
  std::uint32_t header_bytes = 8 * 1024;
  std::uint64_t body_bytes = 64 * 1024;
  // Absolute: a client that sends or reads a byte now and then gains nothing.
  std::chrono::milliseconds header_time{5000};
  std::chrono::milliseconds body_time{5000};
  std::chrono::milliseconds answer_time{10000};  ///< for the station to decide, and for a reply to be taken
  double slowest_bytes_a_second = 64 * 1024.0;   ///< of a download
  std::chrono::milliseconds heartbeat{10000};    ///< of an event stream
  std::chrono::milliseconds beat{500};           ///< of one with beats
};

/// Seats for connections and a rate for requests, by peer. Threads: any.
class Admission : public std::enable_shared_from_this<Admission> {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Door { local, tcp };
  /// Called when the seat went to another connection: close this one. From any thread; must not wait.
  using OnEvicted = std::function<void()>;

  explicit Admission(const ApiLimits& limits);

 private:
  struct Taken {
    std::uint64_t number;
    std::string peer;
    OnEvicted on_evicted;
  };
  using Places = std::list<Taken>;
  /// Seats of one kind, in order of entry.
  struct Pool {
    std::size_t max_seats = 1;
    Places taken{};
    std::map<std::string, std::size_t, std::less<>> by_peer{};
  };

 public:
  /// Freed when it is destroyed.
  class Seat {
   public:
    Seat(std::shared_ptr<Admission> owner, Pool& pool, std::string peer, std::uint64_t number)
        : owner_(std::move(owner)), pool_(pool), peer_(std::move(peer)), number_(number) {}
    ~Seat() { owner_->leave(pool_, number_); }
    Seat(const Seat&) = delete;
    Seat& operator=(const Seat&) = delete;
    [[nodiscard]] const std::string& peer() const { return peer_; }

   private:
    std::shared_ptr<Admission> owner_;
    Pool& pool_;
    std::string peer_;
    std::uint64_t number_;
  };
  using SeatPtr = std::unique_ptr<Seat>;

  /// A waiting place. There is always one: where all are taken, the peer with the most of them loses its oldest.
  SeatPtr wait(Door door, const std::string& peer, OnEvicted on_evicted);
  /// A seat for an authenticated peer. Where all are taken, a peer with at least two more than this one loses its
  /// oldest. Null where none is free, or where this peer has its share.
  SeatPtr enter(Door door, const std::string& peer, OnEvicted on_evicted);
  /// A seat for one request that must not be refused, as wait().
  SeatPtr enter_reserved(const std::string& peer, OnEvicted on_evicted);

  /// Counts a request. False: too many since the last pause. Hanging up gains no new ones.
  bool may_request(const std::string& account, Clock::time_point now) { return take(account, 1.0, now); }
  bool may_order(const std::string& account, Clock::time_point now) {
    return take(account, limits_.price_of_an_order, now);
  }
  void charge_bad_token(const std::string& account, Clock::time_point now) {
    take(account, limits_.price_of_a_bad_token, now);
  }

  [[nodiscard]] std::size_t connections() const;

 private:
  struct Account {
    double requests = 0.0;  ///< allowed at once
    Clock::time_point counted{};
  };
  SeatPtr enter(Pool& pool, const std::string& peer, OnEvicted on_evicted, bool always);
  void leave(Pool& pool, std::uint64_t number);
  static Places::iterator oldest_of_largest(Pool& pool);
  static void remove(Pool& pool, Places::iterator place);
  bool take(const std::string& account, double price, Clock::time_point now);
  void forget_idle(Clock::time_point now);

  const ApiLimits limits_;
  mutable std::mutex mutex_;
  Pool waiting_, local_waiting_, seats_, local_seats_, reserved_;
  std::uint64_t last_number_ = 0;
  std::map<std::string, Account> accounts_;
};

}  // namespace scanrig
