#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/station/snapshot.h"

namespace scanrig {

/// Makes events of changes between snapshots and keeps the newest for returning clients. Threads: any.
class EventHub {
 public:
  /// `life` distinguishes this daemon's numbers from those of the one before.
  explicit EventHub(std::string life, std::size_t kept = 1024) : life_(std::move(life)), kept_(kept) {}

  /// Notifies all subscribers when something that clients can read has changed.
  void see(std::shared_ptr<const Snapshot> snapshot);

  /// What the newest event has led to.
  struct Present {
    std::string life;
    std::uint64_t last = 0;
    std::shared_ptr<const Snapshot> snapshot{};  ///< null before the first
  };
  [[nodiscard]] Present present() const;

  using Text = std::shared_ptr<const std::string>;  ///< of server-sent events, ready to be sent
  struct Batch {
    std::uint64_t last = 0;  ///< number of the newest event
    std::vector<Text> texts{};
  };
  /// For a new client: what it missed since `last_event_id`. Without one, or when that is not kept any more
  /// (then after an event `lost`), the present status.
  [[nodiscard]] Batch join(std::string_view last_event_id) const;
  /// Without a number: it is not kept. `time` as iso_time() writes it.
  [[nodiscard]] Text beat(const std::string& time) const;
  /// Events after `last`; as join() when that is not kept any more.
  [[nodiscard]] Batch after(std::uint64_t last) const;

  /// `wake` is called from any thread when there are new events, and must not wait. Returns its number.
  std::uint64_t subscribe(std::function<void()> wake);
  void unsubscribe(std::uint64_t number);
  [[nodiscard]] std::size_t subscribers() const;

 private:
  void add(std::string_view name, const std::string& data);
  [[nodiscard]] std::string text_of(std::uint64_t number, std::string_view name, const std::string& data) const;
  [[nodiscard]] Batch present_status(bool lost) const;
  [[nodiscard]] Batch since(std::uint64_t last) const;

  const std::string life_;
  const std::size_t kept_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Snapshot> seen_;
  std::string status_;  ///< JSON of the present status, its revision left out
  std::uint64_t last_ = 0;
  std::deque<Text> events_;  ///< numbers last_ - size + 1 to last_
  std::map<std::uint64_t, std::function<void()>> subscribers_;
  std::uint64_t next_subscriber_ = 1;
};

}  // namespace scanrig
