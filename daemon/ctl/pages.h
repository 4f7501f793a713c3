#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace scanrig::ctl {

/// Data for completion and manual pages from a CLI11 tree, hidden verbs left out.
struct OptionWords {
  std::vector<std::string> names{};  ///< "--json"; empty: positional
  std::string description{};
  std::string label{};                ///< for its value: "ID", "FILE", ...; empty: a flag
  std::vector<std::string> values{};  ///< allowed ones; empty: any
  std::string fallback{};             ///< value without it
  std::string variable{};             ///< in the environment
  bool required = false;
};

struct CommandWords {
  std::string path;  ///< "scanrig token add"
  std::string name{}, description{};
  std::vector<OptionWords> options{};  ///< positional ones too
  std::vector<CommandWords> verbs{};
};

CommandWords words_of(const CLI::App& app, const std::string& path_of_parent = "");

/// The command itself and all below it.
std::vector<const CommandWords*> flattened(const CommandWords& command);

/// Completion for a shell, made from the tree of verbs and options: `shell` is bash, zsh or fish.
std::string completion(const CLI::App& app, const std::string& shell);

/// Manual pages by file name, "scanrig.1" and one per verb ("scanrig-status.1").
std::map<std::string, std::string> manual_pages(const CLI::App& app);

}  // namespace scanrig::ctl
