#include "daemon/jobs/executors.h"

#include <system_error>
#include <utility>

#include "core/files.h"
#include "daemon/jobs/child_process.h"
#include "daemon/jobs/progress_lines.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

class ProcessReconstructor final : public Reconstructor {
 public:
  ProcessReconstructor(ProcessExecutorOptions options, const ReconstructionTask& task)
      : options_(std::move(options)), folder_(task.folder), fixture_(task.fixture), changes_(task.changes) {}

  Result<void> add_view(std::size_t, const RawView&, const ViewRecord&, const Context&) override { return {}; }
  Result<void> finish_pose(std::size_t, const Context&) override { return {}; }

  Result<void> finish(const fs::path& folder, const Context& context) override {
    fs::path prepared = folder;
    prepared += ".new";
    std::error_code ignored;
    fs::remove_all(prepared, ignored);
    ProgressLines lines(context);
    const auto end = run_child(command(prepared, lines), context.stop);
    Result<void> done;
    if (!end) {
      done = pass_on(end, "reconstruction");
    } else if (end->code != 0) {
      done = tl::unexpected(told_by(*end, lines.failure));
    } else {
      done = replace_folder(prepared, folder);
    }
    if (!done) fs::remove_all(prepared, ignored);
    return done;
  }

 private:
  [[nodiscard]] ChildCommand command(const fs::path& out, ProgressLines& lines) const {
    ChildCommand command{
        .words = {options_.program.string(), "reconstruct", folder_.string(), "--lines", "--out", out.string(),
                  "--voxel-mm", fmt::format("{}", changes_.voxel_mm.value_or(options_.voxel_mm)), "--memory-gib",
                  fmt::format("{}", static_cast<double>(options_.memory_bytes) / (1U << 30))},
        .limit = options_.limit,
        .memory_bytes = options_.memory_bytes,
        .on_line = [&lines](std::string_view line) { lines(line); }};
    if (fixture_) command.words.emplace_back("--fixture");
    if (!changes_.fusion.empty()) command.words.insert(command.words.end(), {"--fusion", changes_.fusion});
    return command;
  }

  ProcessExecutorOptions options_;
  fs::path folder_;
  bool fixture_;
  ReconstructionChanges changes_;
};

}  // namespace

ReconstructorFactory process_reconstructor(ProcessExecutorOptions options) {
  std::error_code ignored;
  if (options.program.empty()) options.program = fs::read_symlink("/proc/self/exe", ignored).parent_path() / "scanrig";
  return [options = std::move(options)](const ReconstructionTask& task) -> Result<std::unique_ptr<Reconstructor>> {
    return std::make_unique<ProcessReconstructor>(options, task);
  };
}

}  // namespace scanrig
