#pragma once

#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

namespace scanrig {

/// Turns SIGTERM and SIGINT into a stop request. Make it in main() before any other thread: the signals are blocked in
/// every thread started afterwards.
class SignalStop {
 public:
  enum class Hangup { ends, is_told };
  /// `is_told`: SIGHUP no longer ends the program, see on_hangup().
  explicit SignalStop(Hangup hangup = Hangup::ends);
  ~SignalStop();
  SignalStop(const SignalStop&) = delete;
  SignalStop& operator=(const SignalStop&) = delete;

  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

  /// SIGHUP calls `what` from now on, on a thread of this object; without one it is ignored. Waits for a call under
  /// way. From any thread but that one.
  void on_hangup(std::function<void()> what);

 private:
  void run();

  std::stop_source source_;
  std::mutex mutex_;
  std::function<void()> hangup_;  ///< under the mutex
  int caught_;                    ///< signalfd
  int end_;                       ///< eventfd that ends the thread
  std::thread thread_;
};

}  // namespace scanrig
