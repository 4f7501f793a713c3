/// bench_slurm PROGRAM AT_ONCE SCAN...: the models of scan folders by the executor `slurm`, AT_ONCE at a time, as so
/// many rigs would. Prints "SECONDS<tab>SCAN" or "failed<tab>SCAN<tab>MESSAGE" for each.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "daemon/jobs/executors.h"
#include "pipeline/storage/scan_folder.h"

namespace {

using namespace scanrig;

Result<void> make_model(const ReconstructorFactory& factory, const std::filesystem::path& folder) {
  const auto scan = ScanFolder::open(folder);
  if (!scan) return pass_on(scan);
  const auto calibration = scan->load_calibration();
  if (!calibration) return pass_on(calibration);
  const auto made = factory({.calibration = *calibration, .folder = folder});
  if (!made) return pass_on(made);
  return (*made)->finish(folder / "model", {});
}

}  // namespace

int main(int argc, char** argv) {
  const std::span words(argv, static_cast<std::size_t>(argc));
  if (argc < 4) return static_cast<int>(ExitCode::usage);
  SlurmExecutorOptions options;
  options.program = words[1];
  options.cores = 1;
  options.local.memory_bytes = std::uintmax_t{1} << 30;
  options.local.voxel_mm = 1.0;
  const auto factory = slurm_reconstructor(options);
  std::atomic<std::size_t> next = 3;
  std::mutex printing;
  const auto work = [&] {
    for (std::size_t at = next++; at < words.size(); at = next++) {
      const auto begun = std::chrono::steady_clock::now();
      const auto made = make_model(factory, words[at]);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      const std::lock_guard guard(printing);
      if (made) {
        fmt::print("{:.3f}\t{}\n", seconds, words[at]);
      } else {
        fmt::print("failed\t{}\t{}\n", words[at], made.error().message);
      }
      std::fflush(stdout);
    }
  };
  std::vector<std::jthread> rigs(static_cast<std::size_t>(std::atoi(words[2])));
  for (auto& rig : rigs) rig = std::jthread(work);
  return 0;
}
