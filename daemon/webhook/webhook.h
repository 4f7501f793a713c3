#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/runtime/actor.h"
#include "daemon/station/snapshot.h"

namespace scanrig {

struct HttpAddress {
  std::string host, port, path;
};

/// Sends `json` by POST. Fails with `timeout` (of the whole exchange, the look-up of the name included), `io` (cannot
/// connect, cut off), `protocol` (a reply other than 2xx). `stopped` comes at once, whatever it is waiting for.
Result<void> http_post(const HttpAddress& address, const std::string& json, std::chrono::milliseconds limit,
                       const std::stop_token& stop = {});

/// Messages for the change between two snapshots, as JSON: a job that failed, was interrupted or did not pass, a fault
/// of the machine, and a calibration that refuses the next scan.
std::vector<std::string> alerts(const Snapshot& before, const Snapshot& now);

/// Reports failures to one address over HTTP; tries three times, then drops the message. A client that must not miss
/// anything reads the API.
class Webhook {
 public:
  Webhook(Clock& clock, HttpAddress address);
  /// Stops at once: unsent messages are dropped.
  ~Webhook();
  Webhook(const Webhook&) = delete;
  Webhook& operator=(const Webhook&) = delete;

  /// Takes a snapshot, from one thread. Does not wait.
  void look(std::shared_ptr<const Snapshot> now);

 private:
  void run();
  void pause();

  Clock& clock_;
  HttpAddress address_;
  std::shared_ptr<const Snapshot> before_;  ///< for look()'s thread
  Mailbox<std::string> inbox_;
  std::stop_source stop_;
  std::mutex mutex_;
  std::condition_variable stopped_;  ///< stop_ was, under the mutex
  std::thread thread_;
};

}  // namespace scanrig
