#pragma once

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "core/context.h"
#include "core/result.h"
#include "daemon/jobs/child_process.h"

namespace scanrig {

/// Reads the output of `scanrig reconstruct --lines`: "STAGE<tab>FRACTION", and at last "failed<tab>CODE<tab>MESSAGE".
/// Progress is reported to the context, which must outlive this. Threads: one user at a time.
class ProgressLines {
 public:
  explicit ProgressLines(const Context& context) : context_(context) {}

  void operator()(std::string_view line) {
    const auto tab = line.find('\t');
    if (tab == std::string_view::npos) return;
    const auto first = line.substr(0, tab), rest = line.substr(tab + 1);
    double fraction = 0.0;
    if (first == "failed") {
      const auto end = std::min(rest.find('\t'), rest.size());
      failure = Error{parse_error_code(rest.substr(0, end)).value_or(ErrorCode::internal),
                      std::string(rest.substr(std::min(end + 1, rest.size())))};
    } else if (std::from_chars(rest.data(), rest.data() + rest.size(), fraction).ec == std::errc()) {
      context_.report(first, fraction);
    }
  }

  std::optional<Error> failure{};

 private:
  const Context& context_;
};

/// The error of a reconstruction that ended as `end`: its own `failure` line, else its signal or its last words.
inline Error told_by(const ChildEnd& end, const std::optional<Error>& failure) {
  if (failure) return *failure;
  if (end.signal != 0) {
    return {ErrorCode::internal,
            fmt::format("the reconstruction crashed ({}); run `scanrig bundle` and send the archive to support",
                        ::strsignal(end.signal))};
  }
  return {ErrorCode::internal, fmt::format("the reconstruction ended with {}: {}", end.code, end.last_words)};
}

}  // namespace scanrig
