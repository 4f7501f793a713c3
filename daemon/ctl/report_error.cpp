#include <cstdio>

#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {

ExitCode report_error(const Error& error) { return report_error(exit_code(error.code), error.message); }

ExitCode report_error(ExitCode code, const std::string& message) {
  std::fflush(stdout);
  fmt::print(stderr, "scanrig: {}\n", message);
  return code;
}

Error of_device(Error error) {
  if (error.code == ErrorCode::io || error.code == ErrorCode::not_found) error.code = ErrorCode::timeout;
  return error;
}

}  // namespace scanrig::ctl
