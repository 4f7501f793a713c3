#include "daemon/ctl/doctor/operator.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace scanrig::ctl::doctor {

Operator::Operator(bool answers, bool quiet_output)
    : there_(answers || ::isatty(STDIN_FILENO) == 1), quiet_output_(quiet_output) {}

void Operator::tell(const std::string& text) const {
  std::FILE* out = quiet_output_ ? stderr : stdout;
  fmt::print(out, "{}\n", text);
  std::fflush(out);
}

std::optional<std::string> Operator::ask(const std::string& question) const {
  if (!there_) return std::nullopt;
  tell(question);
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  return line;
}

}  // namespace scanrig::ctl::doctor
