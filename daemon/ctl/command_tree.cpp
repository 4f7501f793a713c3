#include "daemon/ctl/command_tree.h"

namespace scanrig::ctl {
namespace {

/// CLI11 names the members of a set in the option's type: "TEXT:{on,off}".
std::vector<std::string> members_in(const std::string& type) {
  std::vector<std::string> members;
  const auto open = type.find('{'), close = type.rfind('}');
  if (open == std::string::npos || close == std::string::npos) return members;
  for (auto at = open + 1; at < close;) {
    const auto end = std::min(type.find(',', at), close);
    members.push_back(type.substr(at, end - at));
    at = end + 1;
  }
  return members;
}

OptionWords words_of(const CLI::Option& option) {
  OptionWords words{.description = option.get_description(),
                    .fallback = option.get_default_str(),
                    .variable = option.get_envname(),
                    .required = option.get_required()};
  for (const auto& name : option.get_snames()) words.names.push_back("-" + name);
  for (const auto& name : option.get_lnames()) words.names.push_back("--" + name);
  words.values = members_in(option.get_type_name());
  const bool takes_value = option.get_items_expected_max() > 0;
  if (words.names.empty()) {
    words.label = option.get_name(true);
  } else if (takes_value) {
    words.label = "VALUE";
    for (const auto* file : {"--out", "--config", "--file", "--socket", "--model", "--drives", "--pose"}) {
      if (words.names.back() == file) words.label = "PATH";
    }
  }
  return words;
}

}  // namespace

CommandWords words_of(const CLI::App& app, const std::string& path_of_parent) {
  CommandWords command{
      .path = path_of_parent + app.get_name(), .name = app.get_name(), .description = app.get_description()};
  // Old names are hidden: accepted, not offered.
  for (const auto* option : app.get_options([](const CLI::Option* one) { return !one->get_group().empty(); }))
    command.options.push_back(words_of(*option));
  for (const auto* verb : app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); })) {
    command.verbs.push_back(words_of(*verb, command.path + " "));
  }
  return command;
}

std::vector<const CommandWords*> flattened(const CommandWords& command) {
  std::vector<const CommandWords*> all{&command};
  for (const auto& verb : command.verbs) {
    const auto below = flattened(verb);
    all.insert(all.end(), below.begin(), below.end());
  }
  return all;
}

}  // namespace scanrig::ctl
