#include <nlohmann/json.hpp>

#include "daemon/ctl/verbs.h"
#include "pipeline/importers/import_stanford.h"

namespace scanrig::ctl {

ExitCode import_stanford(const ImportVerb& verb) {
  const auto pose2 = verb.conf.size() > 1 ? std::optional(verb.conf[1]) : std::nullopt;
  const auto imported = scanrig::import_stanford(verb.conf[0], pose2, verb.out);
  if (!imported) return report_error(imported.error());
  if (verb.json) {
    fmt::print("{}\n", nlohmann::json{{"scan", verb.out}}.dump());
  } else {
    fmt::print("{}\n", verb.out.string());
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
