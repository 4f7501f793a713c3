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

/// The far end of GPIO lines on a machine without a chip: a Unix socket. A client says "output NAME 0|1" and hears
/// "ok" once the level has changed, or "inputs NAME..." and hears the levels as digits, at once and at every change;
/// "unknown NAME" for a line that is not there.
/// Threads: every function may be called from any thread.
class GpioSocket {
 public:
  /// One edge of an output, as it passed.
  struct Edge {
    Clock::TimePoint at;
    std::string line;
    bool high = false;
  };

  /// `lines`: names and their levels at the start. Fails with `io`.
  static Result<std::unique_ptr<GpioSocket>> start(std::filesystem::path path, std::map<std::string, bool> lines,
                                                   Clock& clock);
  ~GpioSocket();

  void set(const std::string& line, bool high);  ///< what a hand on a button does
  [[nodiscard]] bool level(const std::string& line) const;
  [[nodiscard]] std::vector<Edge> edges() const;
  /// Called with every edge of an output, before the client hears "ok"; from the server's thread. Once this returns the
  /// listener of before is not called any more.
  void on_edge(std::function<void(const Edge&)> listener);

 private:
  struct Client;

  GpioSocket(std::filesystem::path path, std::map<std::string, bool> lines, Clock& clock, int listener, int wake);
  void serve(const std::stop_token& stop);
  std::string obey(Client& client, const std::string& words);
  std::string drive(const std::string& name, bool high);
  void tell_changes(std::vector<Client>& clients);

  const std::filesystem::path path_;
  Clock& clock_;
  const int listener_;
  const int wake_;  // an eventfd: something changed, or the end

  mutable std::mutex mutex_;
  std::map<std::string, bool> lines_;
  std::vector<Edge> edges_;
  std::mutex telling_;                        // held while the listener is called; before mutex_
  std::function<void(const Edge&)> on_edge_;  // guarded by telling_
  std::jthread thread_;
};

}  // namespace scanrig::sim::wire
