#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/ctl/verbs.h"
#include "daemon/runtime/signal_stop.h"
#include "pipeline/evaluate/evaluate.h"

namespace scanrig::ctl {
ExitCode evaluate(const EvaluateVerb& verb) {
  const auto truth = read_truth(verb.scan);
  if (!truth) return report_error(truth.error());
  const auto claim = read_claim(verb.model.empty() ? verb.scan / "model" : verb.model);
  if (!claim) return report_error(claim.error());
  const auto photos = ScanFolder::open(verb.scan);
  if (!photos) return report_error(photos.error());

  const SignalStop stop;
  const auto scores = scanrig::evaluate(*claim, *truth, &*photos, {}, {stop.token(), {}});
  if (!scores) return report_error(scores.error());
  const auto limits = gates(*scores);
  if (verb.json) {
    fmt::print("{}\n", to_json(*scores).dump(2));
  } else {
    fmt::print("{}", to_table(*scores));
  }
  const auto missed = std::ranges::count_if(limits, [](const Gate& gate) { return !gate.ok(); });
  if (missed == 0) return ExitCode::ok;
  return report_error(ExitCode::below_limits,
                      fmt::format("{}: {} of {} limits are not reached", verb.scan.string(), missed, limits.size()));
}

}  // namespace scanrig::ctl
