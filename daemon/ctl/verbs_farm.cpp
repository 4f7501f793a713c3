#include <nlohmann/json.hpp>

#include "core/signal_stop.h"
#include "daemon/ctl/farm.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {

ExitCode farm_reprocess(const FarmVerb& verb) {
  const SignalStop stop;
  const auto report = [&](const FarmEnd& end) {
    if (verb.json) {
      nlohmann::ordered_json line{{"scan", end.scan}, {"state", end.error ? "failed" : "done"}};
      if (end.error) line.update({{"code", to_string(end.error->code)}, {"message", end.error->message}});
      fmt::print("{}\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    } else if (end.error) {
      fmt::print("failed  {}: {}\n", end.scan.string(), end.error->message);
    } else {
      fmt::print("done    {}\n", end.scan.string());
    }
    std::fflush(stdout);
  };
  const auto count = run_farm(verb.options, stop.token(), report);
  if (!count && count.error().code == ErrorCode::timeout) {
    return report_error(ExitCode::unreachable, count.error().message);
  }
  if (!count) return report_error(count.error());
  if (verb.json) {
    fmt::print(
        "{}\n",
        nlohmann::ordered_json{{"done", count->done}, {"failed", count->failed}, {"skipped", count->skipped}}.dump());
  } else {
    fmt::print("{} done, {} failed, {} skipped\n", count->done, count->failed, count->skipped);
  }
  if (count->failed == 0) return ExitCode::ok;
  return report_error(exit_code(count->first->code),
                      fmt::format("{} scans failed, the first one: {}", count->failed, count->first->message));
}

}  // namespace scanrig::ctl
