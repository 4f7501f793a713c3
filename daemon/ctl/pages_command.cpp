#include <CLI/CLI.hpp>
#include <memory>

#include "core/files.h"
#include "daemon/ctl/commands.h"
#include "daemon/ctl/pages.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;

/// Where an installation below `share` has them.
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
