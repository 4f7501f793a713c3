#include "config/rig_config.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {

ExitCode check_config(const CheckConfigVerb& verb) {
  const auto config = config::read_rig_config(verb.file, verb.drives);
  if (!config) return complain(config.error());
  fmt::print("{}: no problems\n", verb.file.string());
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
