#pragma once

#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/ctl/commands.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {

/// A verb that talks to the daemon: `run` gets its connection. `Verb` are its own options.
template <class Verb, class Run>
CLI::App* add_client(CLI::App& app, Chosen& chosen, const char* name, const char* description,
                     std::shared_ptr<Verb> verb, Run run) {
  auto* sub = app.add_subcommand(name, description);
  auto connection = std::make_shared<Connection>();
  sub->add_option("--socket", connection->socket, "the daemon's socket")
      ->envname("SCANRIG_SOCKET")
      ->capture_default_str();
  sub->add_flag("--json", connection->json, "print JSON");
  sub->callback(
      [&chosen, connection, verb, run] { chosen = [connection, verb, run] { return run(*connection, *verb); }; });
  return sub;
}

}  // namespace scanrig::ctl
