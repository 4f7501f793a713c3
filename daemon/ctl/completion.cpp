#include <fmt/format.h>
#include <fmt/ranges.h>

#include "daemon/ctl/command_tree.h"
#include "daemon/ctl/pages.h"

namespace scanrig::ctl {
namespace {

bool takes_path(const OptionWords& option) {
  return option.label == "PATH" || option.label == "DIR" || option.label == "FILE";
}

/// 'it'\''s'
std::string quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// Which command the words before the cursor name: the same walk in both shells.
std::string known_paths(const CommandWords& root) {
  std::vector<std::string> paths;
  for (const auto* command : flattened(root)) {
    if (command != &root) paths.push_back(quoted(command->path));
  }
  return fmt::format("{}", fmt::join(paths, "|"));
}

/// `PATH:OPTION) offer ...` a line for each option that has a value; `say` and `files` are the shell's words for it.
std::string value_cases(const CommandWords& root, const std::string& say, const std::string& files) {
  std::string cases;
  for (const auto* command : flattened(root)) {
    for (const auto& option : command->options) {
      if (option.names.empty() || option.label.empty()) continue;
      for (const auto& name : option.names) {
        const auto offer = !option.values.empty() ? fmt::format(fmt::runtime(say), fmt::join(option.values, " "))
                           : takes_path(option)   ? files
                                                  : ":";
        cases += fmt::format("    {}) {}; return ;;\n", quoted(command->path + ":" + name), offer);
      }
    }
  }
  return cases;
}

std::string word_cases(const CommandWords& root, const std::string& say, const std::string& files) {
  std::string cases;
  for (const auto* command : flattened(root)) {
    std::vector<std::string> words;
    bool paths = false;
    for (const auto& verb : command->verbs) words.push_back(verb.name);
    for (const auto& option : command->options) {
      words.insert(words.end(), option.names.begin(), option.names.end());
      if (!option.names.empty()) continue;
      words.insert(words.end(), option.values.begin(), option.values.end());
      paths = paths || takes_path(option);
    }
    cases += fmt::format("    {}) {}{} ;;\n", quoted(command->path),
                         fmt::format(fmt::runtime(say), fmt::join(words, " ")), paths ? "; " + files : "");
  }
  return cases;
}

std::string bash(const CommandWords& root) {
  const std::string say = "COMPREPLY+=($(compgen -W '{}' -- \"$cur\"))";
  const std::string files = "compopt -o filenames; local IFS=$'\\n'; COMPREPLY+=($(compgen -f -- \"$cur\"))";
  return fmt::format(R"(# bash completion for {0}; generated from its command line
_{0}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} path={0} i
  COMPREPLY=()
  # `--option=value` comes as three words
  if [ "$cur" = = ]; then cur=; elif [ "$prev" = = ]; then prev=${{COMP_WORDS[COMP_CWORD-2]}}; fi
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "$path ${{COMP_WORDS[i]}}" in {1}) path="$path ${{COMP_WORDS[i]}}" ;; esac
  done
  case "$path:$prev" in
{2}  esac
  case "$path" in
{3}  esac
}}
complete -F _{0} {0}
)",
                     root.name, known_paths(root), value_cases(root, say, files), word_cases(root, say, files));
}

std::string zsh(const CommandWords& root) {
  const std::string say = "compadd -- {}";
  return fmt::format(R"(#compdef {0}
# zsh completion; generated from the command line of {0}
_{0}() {{
  local prev=${{words[CURRENT-1]}} path_={0} i
  if [[ $words[CURRENT] = --*=* ]]; then prev=${{words[CURRENT]%%=*}}; compset -P '*='; fi
  for ((i = 2; i < CURRENT; i++)); do
    case "$path_ ${{words[i]}}" in ({1}) path_="$path_ ${{words[i]}}" ;; esac
  done
  case "$path_:$prev" in
{2}  esac
  case "$path_" in
{3}  esac
}}
_{0} "$@"
)",
                     root.name, known_paths(root), value_cases(root, say, "_files"), word_cases(root, say, "_files"));
}

/// fish asks option by option; whether the words before the cursor name `command` is one function.
std::string fish(const CommandWords& root) {
  std::string text = fmt::format(R"(# fish completion for {0}; generated from its command line
function __{0}_path
    set -l path {0}
    for word in (commandline -opc)[2..-1]
        switch "$path $word"
            case {1}
                set path "$path $word"
        end
    end
    test "$path" = "$argv"
end
complete -c {0} -f
)",
                                 root.name, [&] {
                                   std::string paths = known_paths(root);
                                   for (auto& c : paths) c = c == '|' ? ' ' : c;
                                   return paths;
                                 }());
  for (const auto* command : flattened(root)) {
    const auto when = fmt::format("complete -c {0} -n \"__{0}_path {1}\"", root.name, command->path);
    for (const auto& verb : command->verbs)
      text += fmt::format("{} -a {} -d {}\n", when, verb.name, quoted(verb.description));
    for (const auto& option : command->options) {
      std::string words;
      for (const auto& name : option.names) {
        words += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (!option.values.empty()) words += fmt::format(" -a '{}'", fmt::join(option.values, " "));
      if (takes_path(option)) words += " -F";
      if (!option.names.empty() && !option.label.empty()) words += takes_path(option) ? " -r" : " -x";
      if (!words.empty()) text += fmt::format("{}{} -d {}\n", when, words, quoted(option.description));
    }
  }
  return text;
}

}  // namespace

std::string completion(const CLI::App& app, const std::string& shell) {
  const auto root = words_of(app);
  if (shell == "bash") return bash(root);
  return shell == "zsh" ? zsh(root) : fish(root);
}

}  // namespace scanrig::ctl
