#include "daemon/ctl/client_command.h"

namespace scanrig::ctl {
namespace {

CLI::Option* add_id(CLI::App* sub, std::string& id) { return sub->add_option("ID", id, "the job"); }

}  // namespace

void add_job_commands(CLI::App& app, Chosen& chosen) {
  const auto list = std::make_shared<JobsVerb>();
  auto* sub = add_client(app, chosen, "jobs", "all jobs, newest first, or one in detail", list, jobs);
  add_id(sub, list->id);
  sub->add_option("--limit", list->limit, "this many at most")->capture_default_str()->check(CLI::Range(1, 100000));
  sub->add_option("--state", list->state, "only jobs in this state")
      ->check(CLI::IsMember(
          {"queued", "scanning", "waiting_for_flip", "reconstructing", "done", "failed", "interrupted", "cancelled"}));
  const auto files = std::make_shared<std::string>();
  add_id(add_client(app, chosen, "files", "the files of a job", files, job_files), *files)->required();
  const auto out = std::make_shared<ExportVerb>();
  sub = add_client(app, chosen, "export", "copy a file of a job, by default its model, from the daemon", out,
                   export_file);
  add_id(sub, out->id)->required();
  sub->add_option("--file", out->file, "which, as `scanrig files` names it")->capture_default_str();
  sub->add_option("--out", out->out, "where to, not there yet (default: ID and the file's name, here)");
}

}  // namespace scanrig::ctl
