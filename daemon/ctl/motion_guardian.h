#pragma once

#include <sys/types.h>

#include <filesystem>
#include <mutex>
#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig::ctl {

/// A child process that makes the rig safe when the program that moves it ends without a confirmed standstill, whatever
/// ended it. A program that stops running in a move (SIGSTOP, a device call that hangs) is killed first.
/// The child has a session of its own, so a terminal's Ctrl-C and hangup do not reach it, and its own process name.
/// Threads: report() from any; all else from the owner's.
class MotionGuardian {
 public:
  /// Starts it before any device is opened and returns once it has read `config`. Fails with `io`, `timeout`, or as
  /// reading the configuration does.
  static Result<MotionGuardian> start(const std::filesystem::path& config, Clock& clock);
  MotionGuardian(MotionGuardian&& other) noexcept;
  MotionGuardian& operator=(MotionGuardian&&) = delete;
  /// Without dismiss() the guardian takes over.
  ~MotionGuardian();

  /// Sign of life, at least every half second while something moves. False: the guardian is gone.
  bool report(bool is_moving);
  /// Standstill is confirmed, or nothing has moved the table. The guardian ends.
  void dismiss();
  /// The guardian stops the table; all devices are closed before. Returns once standstill is confirmed. Fails with
  /// `timeout`: the table may be moving.
  Result<void> take_over();

 private:
  MotionGuardian(int socket, pid_t child) : socket_(socket), child_(child) {}
  void wait_for_exit();

  int socket_ = -1;
  pid_t child_ = -1;
};

/// The guardian's own program, on the socket that is its standard input: the hidden verb `guard-motion`.
ExitCode guard_motion(const std::filesystem::path& config);

}  // namespace scanrig::ctl
