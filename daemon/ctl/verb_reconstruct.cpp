#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <system_error>

#include "daemon/ctl/stage_bars.h"
#include "daemon/ctl/verbs.h"
#include "daemon/runtime/catch_exceptions.h"
#include "daemon/runtime/signal_stop.h"

namespace scanrig::ctl {

namespace {

Result<void> make_model(const ScanFolder& scan, const ReconstructVerb& verb, const Context& context,
                        const std::filesystem::path& out) {
  const auto model = scanrig::reconstruct(scan, verb.options, context);
  if (!model) return pass_on(model);
  return write_model(*model, out);
}

}  // namespace

ExitCode reconstruct(const ReconstructVerb& verb) {
  const auto out = verb.out.empty() ? verb.scan / "model" : verb.out;
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return report_error({ErrorCode::exists, out.string() + ": already there; name another folder with --out"});
  }
  const auto scan = ScanFolder::open(verb.scan);
  if (!scan) return report_error(scan.error());

  const SignalStop stop;
  std::FILE* told = verb.json ? stderr : stdout;  // bars beside the JSON, not in it
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  const auto progress = [&](std::string_view stage, double fraction) {
    if (!verb.lines) return bars.update(std::string(stage), fraction);
    fmt::print("{}\t{:.3f}\n", stage, fraction);
    std::fflush(stdout);
  };
  const auto made = catch_exceptions("the reconstruction", [&] {
    return make_model(*scan, verb, {stop.token(), progress}, out);
  });
  if (!verb.lines) bars.end(made.has_value());
  if (!made) {
    if (verb.lines) fmt::print("failed\t{}\t{}\n", to_string(made.error().code), made.error().message);
    return report_error(made.error());
  }
  const auto glb = out / "model.glb", report = out / "report.json";
  if (verb.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"model", glb}, {"report", report}}.dump());
  } else {
    fmt::print("{}\n{}\n", glb.string(), report.string());
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
