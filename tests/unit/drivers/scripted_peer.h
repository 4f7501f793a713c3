#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sim/wire/pty.h"

namespace scanrig {

/// The far end of a line that handles bytes only. It replies to each expected request with given bytes and records
/// the bytes it receives. Bytes are written as in manuals, "01 03 10 03 00 01 70 CA".
class ScriptedPeer {
 public:
  using Answers = std::map<std::string, std::string>;

  explicit ScriptedPeer(Answers answers) : answers_(std::move(answers)) {
    auto pty = sim::wire::Pty::open(link_);
    EXPECT_TRUE(pty) << pty.error().message;
    thread_ = std::jthread([this, pty = std::move(*pty)](const std::stop_token& stop) mutable { serve(stop, pty); });
  }

  [[nodiscard]] const std::string& device() const { return link_; }
  /// Requests received so far, whole ones only.
  [[nodiscard]] std::vector<std::string> heard() const {
    const std::scoped_lock lock(mutex_);
    return heard_;
  }

 private:
  void serve(const std::stop_token& stop, sim::wire::Pty& pty) {
    std::string pending;
    while (!stop.stop_requested()) {
      const auto bytes = pty.read(std::chrono::milliseconds(10));
      if (bytes.empty()) pending.clear();
      for (const auto byte : bytes) pending += fmt::format("{}{:02X}", pending.empty() ? "" : " ", byte);
      const auto answer = answers_.find(pending);
      if (answer == answers_.end()) continue;
      {
        const std::scoped_lock lock(mutex_);
        heard_.push_back(pending);
      }
      pending.clear();
      sim::wire::Bytes reply;
      for (std::size_t i = 0; i < answer->second.size(); i += 3) {
        reply.push_back(static_cast<std::uint8_t>(std::stoi(answer->second.substr(i, 2), nullptr, 16)));
      }
      pty.write(reply);
    }
  }

  const std::string link_ = testing::TempDir() + fmt::format("peer{}-{}", ::getpid(), fmt::ptr(this));
  const Answers answers_;
  mutable std::mutex mutex_;
  std::vector<std::string> heard_;
  std::jthread thread_;
};

}  // namespace scanrig
