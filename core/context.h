#pragma once

#include <functional>
#include <stop_token>
#include <string_view>

namespace scanrig {

/// Last argument of a long computation: a stop request and a progress report.
/// `progress` may be called from the computing thread only; stage names are short words ("range", "volume").
struct Context {
  std::stop_token stop;
  std::function<void(std::string_view stage, double fraction)> progress;

  [[nodiscard]] bool stopped() const { return stop.stop_requested(); }
  void report(std::string_view stage, double fraction) const {
    if (progress) progress(stage, fraction);
  }
};

}  // namespace scanrig
