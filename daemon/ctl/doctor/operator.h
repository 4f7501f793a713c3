#pragma once

#include <optional>
#include <string>

namespace scanrig::ctl::doctor {

/// The person at the rig, at a terminal or at the other end of standard input.
class Operator {
 public:
  /// `answers`: somebody answers on standard input although it is no terminal. Prompts go to standard error with
  /// `quiet_output`, so that standard output stays JSON.
  Operator(bool answers, bool quiet_output);

  [[nodiscard]] bool there() const { return there_; }
  void tell(const std::string& text) const;
  /// The line that was answered; nothing when nobody is there.
  [[nodiscard]] std::optional<std::string> ask(const std::string& question) const;

 private:
  bool there_;
  bool quiet_output_;
};

}  // namespace scanrig::ctl::doctor
