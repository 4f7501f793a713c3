#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

#include "core/result.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
/// The requested verb; set while the command line is read.
using Chosen = std::function<ExitCode()>;

// The one description of the command line: parsing, help, completion and manual pages are all made from it.
void add_station_commands(CLI::App& app, Chosen& chosen);  ///< status, start, stop, ...: clients of the daemon
void add_job_commands(CLI::App& app, Chosen& chosen);      ///< jobs, export, ...: clients of the daemon
void add_offline_commands(CLI::App& app, Chosen& chosen);  ///< reconstruct, evaluate, check-config, token, ...
void add_rig_commands(CLI::App& app, Chosen& chosen);      ///< at the rig, while no daemon runs
void add_pages_command(CLI::App& app, Chosen& chosen);     ///< hidden: writes completion and manual pages

/// The board at the command line; `is_named` becomes true with any of its options.
void add_board_options(CLI::App& sub, BoardOptions& board, bool& is_named);

/// A verb that sends requests to the daemon: `run` gets its connection. `Verb` holds its options.
template <class Verb, class Run>
CLI::App* add_client(CLI::App& app, Chosen& chosen, const char* name, const char* description,
                     std::shared_ptr<Verb> verb, Run run) {
  auto* sub = app.add_subcommand(name, description);
  auto connection = std::make_shared<Connection>();
  sub->add_option("--socket", connection->socket, "the service's socket")
      ->envname("SCANRIG_SOCKET")
      ->capture_default_str();
  sub->add_flag("--json", connection->json, "print JSON");
  sub->callback(
      [&chosen, connection, verb, run] { chosen = [connection, verb, run] { return run(*connection, *verb); }; });
  return sub;
}

/// One of a verb's actions: `run` gets the verb with the action's name as `what`.
template <class Verb>
CLI::App* add_action(CLI::App& sub, Chosen& chosen, const char* name, const char* description,
                     std::shared_ptr<Verb> verb, ExitCode (*run)(const Verb&)) {
  auto* action = sub.add_subcommand(name, description);
  action->callback([&chosen, verb, name, run] {
    verb->what = name;
    chosen = [verb, run] { return run(*verb); };
  });
  return action;
}

}  // namespace scanrig::ctl
