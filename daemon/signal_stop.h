#pragma once

#include <stop_token>
#include <thread>

namespace scanrig {

/// Turns SIGTERM and SIGINT into a stop request. Make it in main() before any other thread: the signals are blocked in
/// every thread started afterwards.
class SignalStop {
 public:
  SignalStop();
  ~SignalStop();
  SignalStop(const SignalStop&) = delete;
  SignalStop& operator=(const SignalStop&) = delete;

  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  int end_;  ///< eventfd that ends the thread
  std::thread thread_;
};

}  // namespace scanrig
