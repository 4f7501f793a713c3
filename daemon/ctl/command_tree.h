#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace scanrig::ctl {

/// What completion and manual pages need of a CLI11 tree, hidden verbs left out.
struct OptionWords {
  std::vector<std::string> names{};  ///< "--json"; empty: positional
  std::string description{};
  std::string label{};                ///< of its value: "ID", "FILE", ...; empty: a flag
  std::vector<std::string> values{};  ///< that it may have; empty: any
  std::string fallback{};             ///< value without it
  std::string variable{};             ///< of the environment
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

}  // namespace scanrig::ctl
