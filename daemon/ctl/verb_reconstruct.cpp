#include <unistd.h>

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
  StageBars bars(stdout, ::isatty(STDOUT_FILENO) == 1);
  const Context context{stop.token(),
                        [&](std::string_view stage, double fraction) { bars.update(std::string(stage), fraction); }};
  const auto model = scanrig::reconstruct(*scan, verb.options, context);
  bars.end(model.has_value());
  if (!model) return complain(model.error());
  if (const auto written = write_model(*model, out); !written) return complain(written.error());
  fmt::print("{}\n{}\n", (out / "model.glb").string(), (out / "report.json").string());
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
