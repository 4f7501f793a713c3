#pragma once

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "daemon/ctl/client.h"

namespace scanrig::ctl {
/// Output of the daemon's replies, for the verbs that send requests to it.
ExitCode report_error(const RequestError& error);
void print(const nlohmann::json& answer);
/// The text behind `key`; empty where there is none.
std::string text(const nlohmann::json& object, const char* key);
/// "1.2 GiB"
std::string bytes_text(double bytes);

/// Lines and a bar per stage. On a terminal the running stage's bar is drawn over itself; in a log each stage is one
/// line, written when it is complete. Threads: one user at a time.
class StageBars {
 public:
  StageBars(std::FILE* out, bool terminal) : out_(out), terminal_(terminal) {}

  void line(std::string_view text);
  void update(const std::string& stage, double fraction);
  /// Ends the output: stages that never reported 1 are complete (or stay where they are, if the work failed).
  void end(bool success);

 private:
  struct Stage {
    Clock::TimePoint begun;
    double fraction = 0.0;
    bool written = false;
  };
  void write(const std::string& name, Stage& stage);
  void draw(const std::string& name, const Stage& stage);
  void clear();

  std::FILE* out_;
  bool terminal_;
  bool drawn_ = false;
  RealClock clock_;
  std::map<std::string, Stage, std::less<>> stages_;
};

/// "  range               [##########----------]  50 %"
std::string bar(std::string_view name, double fraction);
/// The same, and "    1.2 s".
std::string bar(std::string_view name, double fraction, Clock::Duration spent);

}  // namespace scanrig::ctl
