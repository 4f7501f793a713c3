#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"

namespace scanrig::config::setup {

/// An end of a connection, closed with this.
class ConnectionEnd {
 public:
  ConnectionEnd() = default;
  explicit ConnectionEnd(int fd) : fd_(fd) {}
  ConnectionEnd(ConnectionEnd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  ConnectionEnd& operator=(ConnectionEnd&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~ConnectionEnd() { close(); }
  void close();
  [[nodiscard]] int fd() const { return fd_; }  ///< -1: closed

 private:
  int fd_ = -1;
};

/// A program that is run for its conversation, in a process group of its own. Its input is a socket: writing to a
/// program that died ends nothing. It inherits no other descriptor.
/// Threads: one owner, which lives as long as the program: the program may have asked to die with it.
class AskingProgram {
 public:
  /// `words`: its path first. Fails with `io`.
  static Result<AskingProgram> start(std::vector<std::string> words);

  void write(const std::string& line) const;
  /// Waits for output, 0.1 s at most; `on_line` gets each whole line of it. False: it has ended, and all was read.
  bool read(const std::function<void(const std::string&)>& on_line);
  /// The replies end: the program switches off what it has on, and ends. Killed after `grace`.
  void end(std::chrono::milliseconds grace);

  [[nodiscard]] int code() const;                                              ///< exit code; -1: a signal ended it
  [[nodiscard]] const std::string& last_words() const { return last_words_; }  ///< last line of its standard error

 private:
  pid_t pid_ = -1;
  int status_ = 0;
  ConnectionEnd in_, out_, error_;
  std::string out_text_, error_text_, last_words_;
};

}  // namespace scanrig::config::setup
