#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/ctl/verbs.h"
#include "daemon/signal_stop.h"
#include "pipeline/evaluate/evaluate.h"

namespace scanrig::ctl {
namespace {

nlohmann::json to_json(const Gate& gate) {
  return {{"name", gate.name},
          {"limit", gate.limit},
          {"measured", gate.measured},
          {"at_most", gate.at_most},
          {"ok", gate.ok()}};
}

}  // namespace

ExitCode evaluate(const EvaluateVerb& verb) {
  const auto truth = read_truth(verb.scan);
  if (!truth) return complain(truth.error());
  const auto claim = read_claim(verb.model.empty() ? verb.scan / "model" : verb.model);
  if (!claim) return complain(claim.error());
  const auto photos = ScanFolder::open(verb.scan);
  if (!photos) return complain(photos.error());

  const SignalStop stop;
  const auto scores = scanrig::evaluate(*claim, *truth, &*photos, {}, {stop.token(), {}});
  if (!scores) return complain(scores.error());
  const auto limits = gates(*scores);
  if (verb.json) {
    auto json = scanrig::to_json(*scores);
    for (const auto& gate : limits) json["gates"].push_back(to_json(gate));
    fmt::print("{}\n", json.dump(2));
  } else {
    fmt::print("{}", to_table(*scores));
  }
  const auto missed = std::ranges::count_if(limits, [](const Gate& gate) { return !gate.ok(); });
  if (missed == 0) return ExitCode::ok;
  return complain(ExitCode::below_limits,
                  fmt::format("{}: {} of {} limits are not reached", verb.scan.string(), missed, limits.size()));
}

}  // namespace scanrig::ctl
