#include "daemon/ctl/pages.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <set>

#include "daemon/ctl/commands.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig::ctl {
namespace {

using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

class Pages : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    add_station_commands(app, chosen);
    add_job_commands(app, chosen);
    add_offline_commands(app, chosen);
    add_rig_commands(app, chosen);
    add_pages_command(app, chosen);
  }
  /// Output of a command, its errors too; "" with `absent` where the program is not installed.
  static std::string output_of(const std::string& command) {
    std::string text;
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen((command + " 2>&1").c_str(), "r"), ::pclose);
    std::array<char, 4096> room{};
    while (pipe && std::fgets(room.data(), room.size(), pipe.get()) != nullptr) text += room.data();
    return text;
  }
  static bool installed(const std::string& program) { return !output_of("command -v " + program).empty(); }
  std::string file(const std::string& name, const std::string& text) const {
    scan_samples::write_text(folder_ / name, text);
    return folder_ / name;
  }
  /// The words that bash offers after `line`.
  std::set<std::string> offered(const std::string& line) const {
    const auto script = file("test.bash", "source " + file("scanrig.bash", completion(app, "bash")) + "\nCOMP_WORDS=(" +
                                              line + ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n" +
                                              "compopt() { :; }\n_scanrig\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n");
    std::istringstream offers(output_of("bash " + script));
    std::set<std::string> words;
    for (std::string word; std::getline(offers, word);) words.insert(word);
    return words;
  }
  CLI::App app{"a rig's command", "scanrig"};
  Chosen chosen;
};

TEST_F(Pages, BashOffersVerbsOptionsAndValues) {
  EXPECT_THAT(offered("scanrig ''"), IsSupersetOf({"status", "start", "stop", "jobs", "export", "token"}));
  EXPECT_EQ(offered("scanrig sto"), std::set<std::string>{"stop"});
  EXPECT_THAT(offered("scanrig status --"), IsSupersetOf({"--json", "--watch", "--follow"}));
  EXPECT_EQ(offered("scanrig token ''").count("revoke"), 1u);
  EXPECT_EQ(offered("scanrig token add x --role ''"), (std::set<std::string>{"viewer", "operator", "engineer"}));
  EXPECT_EQ(offered("scanrig token add x --role = op"), std::set<std::string>{"operator"});
  EXPECT_EQ(offered("scanrig token add x --role =").size(), 3u);
  EXPECT_THAT(offered("scanrig maintenance ''"), IsSupersetOf({"on", "off", "jog"}));
}

TEST_F(Pages, BashOffersFilesWhoseNamesHaveSpaces) {
  const auto path = file("my scan", "");
  EXPECT_EQ(offered("scanrig export x --out '" + path.substr(0, path.size() - 2) + "'"), std::set<std::string>{path});
}

TEST_F(Pages, WhatIsHiddenIsNotOffered) {
  for (const auto* shell : {"bash", "zsh", "fish"}) {
    EXPECT_THAT(completion(app, shell), Not(HasSubstr("write-pages"))) << shell;
  }
}

TEST_F(Pages, EveryShellReadsItsCompletion) {
  EXPECT_EQ(output_of("bash -n " + file("c.bash", completion(app, "bash"))), "");
  if (installed("zsh")) {
    EXPECT_EQ(output_of("zsh -n " + file("_c", completion(app, "zsh"))), "");
  }
  if (installed("fish")) {
    EXPECT_EQ(output_of("fish -n " + file("c.fish", completion(app, "fish"))), "");
  }
  EXPECT_THAT(completion(app, "zsh"), testing::StartsWith("#compdef scanrig\n"));
  EXPECT_THAT(completion(app, "fish"), HasSubstr("__scanrig_path scanrig token add\" -l role"));
  EXPECT_THAT(completion(app, "zsh"), HasSubstr("compset -P '*='"));
  if (installed("fish")) {
    const auto offers =
        output_of("fish -c \"cd " + folder_.string() + "; source " + file("c.fish", completion(app, "fish")) +
                  "; complete -C 'scanrig token add x --role '\"");
    EXPECT_THAT(offers, HasSubstr("operator"));
    EXPECT_THAT(offers, Not(HasSubstr("c.fish"))) << "no files";
  }
}

TEST_F(Pages, EveryVerbHasAPageThatNamesItsOptions) {
  const auto pages = manual_pages(app);
  const auto root = words_of(app);
  ASSERT_EQ(pages.size(), root.verbs.size() + 1);
  for (const auto& verb : root.verbs) {
    const auto& page = pages.at("scanrig-" + verb.name + ".1");
    EXPECT_THAT(pages.at("scanrig.1"), HasSubstr("\\fB" + verb.name.substr(0, 3)));
    for (const auto* section :
         {".TH ", ".SH NAME", ".SH SYNOPSIS", ".SH DESCRIPTION", ".SH OPTIONS", ".SH EXIT STATUS"}) {
      EXPECT_THAT(page, HasSubstr(section)) << verb.name;
    }
    for (const auto* command : flattened(verb)) {
      for (const auto& option : command->options) {
        if (option.names.empty()) continue;
        std::string name;
        for (const char c : option.names.back()) name += c == '-' ? "\\-" : std::string(1, c);
        EXPECT_THAT(page, HasSubstr(name)) << verb.name;
      }
    }
  }
}

TEST_F(Pages, TheManualIsReadWithoutComplaint) {
  if (!installed("man") && !installed("mandoc")) GTEST_SKIP() << "neither man nor mandoc is installed";
  for (const auto& [name, text] : manual_pages(app)) {
    const auto path = file(name, text);
    if (installed("mandoc")) {
      // Without a date, so that a version's pages are always the same.
      EXPECT_EQ(output_of("mandoc -Tlint -W warning " + path + " | grep -v 'missing date'"), "") << name;
    }
    if (!installed("man")) continue;
    const auto shown = output_of("LC_ALL=C MANWIDTH=80 man --warnings -l " + path + " | cat");
    EXPECT_THAT(shown, HasSubstr("EXIT STATUS")) << name;
    EXPECT_THAT(shown, Not(HasSubstr("warning:"))) << name;
  }
}

TEST_F(Pages, AreWrittenWhereAnInstallationHasThem) {
  EXPECT_EQ(output_of(std::string(SCANRIG_PROGRAM) + " write-pages " + folder_.string()), "");
  for (const auto* name : {"man/man1/scanrig.1", "man/man1/scanrig-status.1", "bash-completion/completions/scanrig",
                           "zsh/vendor-completions/_scanrig", "fish/vendor_completions.d/scanrig.fish"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
  }
}

}  // namespace
}  // namespace scanrig::ctl
