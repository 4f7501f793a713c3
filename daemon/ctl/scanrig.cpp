#include <CLI/CLI.hpp>

#include "daemon/ctl/commands.h"
#include "daemon/ctl/verbs.h"

int main(int argc, char** argv) {
  using namespace scanrig;
  using namespace scanrig::ctl;
  CLI::App app("the operator's and engineer's command of a 3D-scanning rig", "scanrig");
  app.require_subcommand(1);
  app.footer("Exit codes: docs/reference/exit-codes.md");
  Chosen chosen;
  add_station_commands(app, chosen);
  add_job_commands(app, chosen);
  add_offline_commands(app, chosen);
  add_rig_commands(app, chosen);
  add_pages_command(app, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return static_cast<int>(report_error(ExitCode::usage, error.what()));
  }
  return static_cast<int>(chosen());
}
