#include "daemon/ctl/pages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <cctype>
#include <memory>

#include "core/files.h"
#include "core/version.h"
#include "daemon/ctl/commands.h"
#include "daemon/ctl/verbs.h"

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

bool takes_path(const OptionWords& option) {
  return option.label == "PATH" || option.label == "DIR" || option.label == "FILE";
}

/// 'it'\''s'
std::string quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// The command that the words before the cursor name: the same walk in both shells.
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

/// fish completes option by option; one function tests whether the words before the cursor name `command`.
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

std::string completion(const CLI::App& app, const std::string& shell) {
  const auto root = words_of(app);
  if (shell == "bash") return bash(root);
  return shell == "zsh" ? zsh(root) : fish(root);
}

namespace {

/// Escapes for roff: no line starts with a control character, dashes can be copied, backslashes are shown.
std::string roff(const std::string& text) {
  std::string plain = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) {
    if (c == '\\') {
      plain += "\\e";
    } else if (c == '-') {
      plain += "\\-";
    } else {
      plain += c;
    }
  }
  return plain;
}

std::string dashed(std::string path) {
  for (auto& c : path) c = c == ' ' ? '-' : c;
  return path;
}

std::string upper(std::string text) {
  for (auto& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// "Description of a verb."
std::string sentence(const std::string& description) {
  auto text = roff(description);
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text + ".";
}

std::string begin(const CommandWords& command) {
  return fmt::format(".TH \"{}\" \"1\" \"\" \"scanrig {}\" \"User commands\"\n.SH NAME\n{} \\- {}\n",
                     upper(dashed(command.path)), kVersion, roff(dashed(command.path)), roff(command.description));
}

std::string synopsis(const CommandWords& command) {
  std::string text = fmt::format(".B {}\n", roff(command.path));
  if (!command.verbs.empty()) text += ".I VERB\n";
  for (const auto& option : command.options) {
    if (!option.names.empty()) continue;
    text += option.required ? fmt::format(".I {}\n", roff(option.label))
                            : fmt::format("[\\fI{}\\fR]\n", roff(option.label));
  }
  return text + "[options]\n";
}

std::string entry(const OptionWords& option) {
  std::string head = option.names.empty()
                         ? fmt::format("\\fI{}\\fR", roff(option.label))
                         : fmt::format("\\fB{}\\fR", roff(fmt::format("{}", fmt::join(option.names, ", "))));
  if (!option.names.empty() && !option.label.empty()) head += fmt::format(" \\fI{}\\fR", option.label);
  std::string text = fmt::format(".TP\n{}\n{}.\n", head, roff(option.description));
  if (!option.values.empty())
    text += fmt::format("One of: {}.\n", roff(fmt::format("{}", fmt::join(option.values, ", "))));
  if (!option.fallback.empty()) text += fmt::format("Default: {}.\n", roff(option.fallback));
  if (!option.variable.empty()) text += fmt::format("The environment variable\n.B {}\nsays it too.\n", option.variable);
  return text;
}

std::string options(const CommandWords& command) {
  std::string text;
  for (const auto& option : command.options) text += entry(option);
  return text;
}

constexpr const char* kExit =
    ".SH EXIT STATUS\n0 when done; every other code has a meaning of its own: 2 the command line, 3 bad input, 4 the\n"
    "disk, 5 a device, 6 refused, 7 no model, 8 below the limits, 9 no service responds, 10 stopped, 1 a bug. One\n"
    "sentence on standard error says what happened and what to do.\n";

std::string page_of(const CommandWords& verb, const std::string& program) {
  std::string text = begin(verb) + ".SH SYNOPSIS\n" + synopsis(verb);
  for (const auto& below : verb.verbs) text += ".br\n" + synopsis(below);
  text += ".SH DESCRIPTION\n" + sentence(verb.description) + "\n.SH OPTIONS\n" + options(verb);
  for (const auto& below : verb.verbs) {
    text += fmt::format(".SS {}\n{}\n", roff(below.path), sentence(below.description)) + options(below);
  }
  return text + kExit + fmt::format(".SH SEE ALSO\n.BR {} (1)\n", program);
}

}  // namespace

std::map<std::string, std::string> manual_pages(const CLI::App& app) {
  const auto root = words_of(app);
  std::map<std::string, std::string> pages;
  std::string text =
      begin(root) + ".SH SYNOPSIS\n" + synopsis(root) + ".SH DESCRIPTION\n" +
      fmt::format("{} is {}.\nEach verb has a page of its own.\n.SH VERBS\n", root.name, roff(root.description));
  for (const auto& verb : root.verbs) {
    text += fmt::format(".TP\n\\fB{}\\fR\n{}.\n", roff(verb.name), roff(verb.description));
    pages[dashed(verb.path) + ".1"] = page_of(verb, root.name);
  }
  pages[root.name + ".1"] = text + ".SH OPTIONS\n" + options(root) + kExit;
  return pages;
}

namespace {

namespace fs = std::filesystem;

/// Places of the files in an installation below `share`.
Result<void> write_pages(const CLI::App& app, const fs::path& share) {
  std::map<fs::path, std::string> files{{"bash-completion/completions/scanrig", completion(app, "bash")},
                                        {"zsh/vendor-completions/_scanrig", completion(app, "zsh")},
                                        {"fish/vendor_completions.d/scanrig.fish", completion(app, "fish")}};
  for (auto& [name, text] : manual_pages(app)) files[fs::path("man/man1") / name] = text;
  for (const auto& [name, text] : files) {
    if (auto made = create_directories_synced((share / name).parent_path()); !made) return made;
    if (auto written = write_file_atomically(share / name, text); !written) return written;
  }
  return {};
}

}  // namespace

void add_pages_command(CLI::App& app, Chosen& chosen) {
  const auto share = std::make_shared<fs::path>();
  auto* sub = app.add_subcommand("write-pages", "write completion and manual pages below a folder")->group("");
  sub->add_option("DIR", *share, "the folder, such as /usr/share")->required();
  sub->callback([&app, &chosen, share] {
    chosen = [&app, share] {
      const auto written = write_pages(app, *share);
      return written ? ExitCode::ok : report_error(written.error());
    };
  });
}

}  // namespace scanrig::ctl
