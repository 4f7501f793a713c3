#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace scanrig {

/// What one client, and all of them together, may use up.
struct ApiLimits {
  std::size_t connections = 256;
  std::size_t connections_a_peer = 128;  ///< a peer is a user of this machine, or an address
  double requests_a_second = 1000.0;     ///< a peer, on average
  double requests_at_once = 1000.0;      ///< a peer, after a pause
  double price_of_a_bad_token = 100.0;   ///< in requests: 10 guesses a second
  std::uint32_t header_bytes = 8 * 1024;
  std::uint64_t body_bytes = 64 * 1024;
  // Absolute: a client that sends or reads a byte now and then gains nothing.
  std::chrono::milliseconds header_time{5000};
  std::chrono::milliseconds body_time{5000};
  std::chrono::milliseconds answer_time{10000};  ///< for the station to decide, and for an answer to be taken
  double slowest_bytes_a_second = 64 * 1024.0;   ///< of a download
  std::chrono::milliseconds heartbeat{10000};    ///< of an event stream
};

/// Counts connections and requests by peer. Threads: any.
class Admission : public std::enable_shared_from_this<Admission> {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Admission(ApiLimits limits) : limits_(limits) {}

  /// A place among the connections, given back when it is destroyed.
  class Seat {
   public:
    Seat(std::shared_ptr<Admission> owner, std::string peer) : owner_(std::move(owner)), peer_(std::move(peer)) {}
    ~Seat() { owner_->leave(peer_); }
    Seat(const Seat&) = delete;
    Seat& operator=(const Seat&) = delete;
    /// Whether the peer may ask once more now.
    [[nodiscard]] bool may_ask(Clock::time_point now) { return owner_->take(peer_, 1.0, now); }
    [[nodiscard]] const std::string& peer() const { return peer_; }
    void showed_bad_token(Clock::time_point now) { owner_->take(peer_, owner_->limits_.price_of_a_bad_token, now); }

   private:
    std::shared_ptr<Admission> owner_;
    std::string peer_;
  };
  /// Nothing when too many are there.
  std::unique_ptr<Seat> enter(const std::string& peer);
  /// For one that is only told so; nothing when too many of those are there already.
  std::unique_ptr<Seat> enter_to_be_turned_away();

  [[nodiscard]] std::size_t connections() const;

 private:
  struct Peer {
    std::size_t connections = 0;
    double requests = 0.0;  ///< that it may ask at once
    Clock::time_point counted{};
  };
  void leave(const std::string& peer);
  bool take(const std::string& peer, double price, Clock::time_point now);
  void forget_idle(Clock::time_point now);

  const ApiLimits limits_;
  mutable std::mutex mutex_;
  std::map<std::string, Peer> peers_;
  std::size_t connections_ = 0;
};

}  // namespace scanrig
