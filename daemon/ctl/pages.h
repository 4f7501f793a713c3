#pragma once

#include <map>
#include <string>

namespace CLI {
class App;
}

namespace scanrig::ctl {

/// Completion for a shell, made from the tree of verbs and options: `shell` is bash, zsh or fish.
std::string completion(const CLI::App& app, const std::string& shell);

/// Manual pages by file name, "scanrig.1" and one per verb ("scanrig-status.1").
std::map<std::string, std::string> manual_pages(const CLI::App& app);

}  // namespace scanrig::ctl
