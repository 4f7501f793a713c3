#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>

#include "core/version.h"
#include "daemon/ctl/command_tree.h"
#include "daemon/ctl/pages.h"

namespace scanrig::ctl {
namespace {

/// For roff: no line begins with a control character, dashes can be copied, backslashes are shown.
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

/// "What is said of a verb."
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
    "disk, 5 a device, 6 refused, 7 no model, 8 below the limits, 9 no daemon answers, 10 stopped, 1 a bug. One\n"
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

}  // namespace scanrig::ctl
