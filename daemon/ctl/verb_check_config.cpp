#include <nlohmann/json.hpp>
#include <sstream>

#include "config/rig_config.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {

ExitCode check_config(const CheckConfigVerb& verb) {
  const auto config = config::read_rig_config(verb.file, verb.drives);
  if (verb.json) {
    auto problems = nlohmann::ordered_json::array();
    std::istringstream lines(config ? std::string() : config.error().message);
    for (std::string line; std::getline(lines, line);) problems.push_back(line);
    const auto warnings = config ? config->warnings : std::vector<std::string>();
    fmt::print("{}\n",
               nlohmann::ordered_json{
                   {"file", verb.file}, {"ok", config.has_value()}, {"problems", problems}, {"warnings", warnings}}
                   .dump(2));
  }
  if (!config && verb.json) {
    return report_error(exit_code(config.error().code), verb.file.string() + " cannot be used: see its problems");
  }
  if (!config) return report_error(config.error());
  if (!verb.json) {
    for (const auto& warning : config->warnings) fmt::print(stderr, "{}\n", warning);
    fmt::print("{}: no problems\n", verb.file.string());
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
