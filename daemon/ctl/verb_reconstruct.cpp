#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <system_error>

#include "daemon/ctl/stage_bars.h"
#include "daemon/ctl/verbs.h"
#include "daemon/signal_stop.h"

namespace scanrig::ctl {

ExitCode reconstruct(const ReconstructVerb& verb) {
  const auto out = verb.out.empty() ? verb.scan / "model" : verb.out;
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return complain({ErrorCode::exists, out.string() + ": already there; name another folder with --out"});
  }
  const auto scan = ScanFolder::open(verb.scan);
  if (!scan) return complain(scan.error());

  const SignalStop stop;
  std::FILE* told = verb.json ? stderr : stdout;  // bars beside the JSON, not in it
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  const Context context{stop.token(),
                        [&](std::string_view stage, double fraction) { bars.update(std::string(stage), fraction); }};
  const auto model = scanrig::reconstruct(*scan, verb.options, context);
  bars.end(model.has_value());
  if (!model) return complain(model.error());
  if (const auto written = write_model(*model, out); !written) return complain(written.error());
  const auto glb = out / "model.glb", report = out / "report.json";
  if (verb.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"model", glb}, {"report", report}}.dump());
  } else {
    fmt::print("{}\n{}\n", glb.string(), report.string());
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
