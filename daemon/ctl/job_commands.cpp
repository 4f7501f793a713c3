#include "daemon/ctl/client_command.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig::ctl {
namespace {

CLI::Option* add_id(CLI::App* sub, std::string& id) { return sub->add_option("ID", id, "the job"); }

template <class Verb>
CLI::App* add_change(CLI::App& app, Chosen& chosen, const char* name, const char* description,
                     const std::shared_ptr<Verb>& verb) {
  verb->what = name;
  auto* sub = add_client(app, chosen, name, description, verb, change_job);
  add_id(sub, verb->id)->required();
  return sub;
}

void add_changes(CLI::App& app, Chosen& chosen) {
  const auto verb = [] { return std::make_shared<JobVerb>(); };
  add_change(app, chosen, "cancel", "end a job that is queued, interrupted or being reconstructed", verb());
  add_change(app, chosen, "resume", "let the next Start go on with an interrupted job", verb());
  add_change(app, chosen, "first", "let the next Start begin this queued job", verb());
  const auto again = verb();
  auto* sub = add_change(app, chosen, "reprocess", "make the model again, from the images", again);
  sub->add_option("--voxel-mm", again->voxel_mm, "size of a voxel")->check(CLI::Range(kMinVoxelMm, kMaxVoxelMm));
  sub->add_option("--fusion", again->fusion, "how poses are integrated")->check(CLI::IsMember({"evidence", "paper"}));
  const auto removed = verb();
  add_change(app, chosen, "delete", "remove a job that has ended, with all its files", removed)
      ->add_flag("--yes", removed->yes, "do not ask");
}

}  // namespace

void add_job_commands(CLI::App& app, Chosen& chosen) {
  const auto list = std::make_shared<JobsVerb>();
  auto* sub = add_client(app, chosen, "jobs", "all jobs, newest first, or one in detail", list, jobs);
  add_id(sub, list->id);
  sub->add_option("--limit", list->limit, "this many at most")->capture_default_str()->check(CLI::Range(1, 100000));
  sub->add_option("--state", list->state, "only jobs in this state")
      ->check(CLI::IsMember(
          {"queued", "scanning", "waiting_for_flip", "reconstructing", "done", "failed", "interrupted", "cancelled"}));
  const auto order = std::make_shared<QueueVerb>();
  sub = add_client(app, chosen, "queue", "queue scans and print the first one's id", order, queue);
  sub->add_option("--recipe", order->recipe, "one of the configuration's")->capture_default_str();
  sub->add_option("--part", order->part, "of what is scanned: barcode or free text");
  sub->add_option("--repeat", order->repeat, "so many jobs")->capture_default_str()->check(CLI::Range(1, 100));
  add_changes(app, chosen);
  const auto files = std::make_shared<std::string>();
  add_id(add_client(app, chosen, "files", "the files of a job", files, job_files), *files)->required();
  const auto out = std::make_shared<ExportVerb>();
  sub = add_client(app, chosen, "export", "copy a file of a job, by default its model, from the daemon", out,
                   export_file);
  add_id(sub, out->id)->required();
  sub->add_option("--file", out->file, "which, as `scanrig files` names it")->capture_default_str();
  sub->add_option("--out", out->out, "where to, not there yet (default: ID and the file's name, here)");
  const auto pack = std::make_shared<BundleVerb>();
  sub = add_client(app, chosen, "bundle", "pack a job for whoever must help", pack, bundle);
  add_id(sub, pack->id)->required();
  sub->add_option("--out", pack->out, "the archive, not there yet (default: ID.tar.gz, here)");
}

}  // namespace scanrig::ctl
