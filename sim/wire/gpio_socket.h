#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig::sim::wire {

/// The far end of GPIO lines on a machine without a chip: a Unix socket. A client sends "output NAME 0|1" and receives
/// "ok" once the level has changed, or sends "inputs NAME..." and receives the levels as digits, at once and at every
/// change; "unknown NAME" for a missing line.
/// Threads: every function may be called from any thread.
class GpioSocket {
 public:
  /// One edge of an output.
  struct Edge {
    Clock::TimePoint at;
    std::string line;
    bool high = false;
  };

  /// `lines`: names and their levels at the start. Fails with `io`.
  static Result<std::unique_ptr<GpioSocket>> start(std::filesystem::path path, std::map<std::string, bool> lines,
                                                   Clock& clock);
  ~GpioSocket();

  void set(const std::string& line, bool high);  ///< action of a hand on a button
  [[nodiscard]] bool level(const std::string& line) const;
  [[nodiscard]] std::vector<Edge> edges() const;
  /// Called with every edge of an output, before the client receives "ok"; from the server's thread. After the return
  /// the previous listener is no longer called.
  void on_edge(std::function<void(const Edge&)> listener);

 private:
  struct Client;

  GpioSocket(std::filesystem::path path, std::map<std::string, bool> lines, Clock& clock, int listener, int wake);
  void serve(const std::stop_token& stop);
  std::string obey(Client& client, const std::string& words);
  std::string drive(const std::string& name, bool high);
  void send_changes(std::vector<Client>& clients);

  const std::filesystem::path path_;
  Clock& clock_;
  const int listener_;
  const int wake_;  // an eventfd: a change, or the end

  mutable std::mutex mutex_;
  std::map<std::string, bool> lines_;
  std::vector<Edge> edges_;
  std::mutex calling_;                        // held while the listener is called; before mutex_
  std::function<void(const Edge&)> on_edge_;  // guarded by calling_
  std::jthread thread_;
};

}  // namespace scanrig::sim::wire
