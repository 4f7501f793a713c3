// bench_dragon DATA SCAN [MODEL]: the model of an imported scan of the Stanford dragon (MODEL: its folder, default
// SCAN/model) against what came with the scans in DATA; prints what dragon_measure.h defines, as JSON.

#include <fmt/format.h>

#include <cstdio>

#include "pipeline/evaluate/evaluate.h"
#include "tests/bench/real_data/dragon_measure.h"

namespace {

scanrig::Result<scanrig::bench::DragonMeasure> run(const std::filesystem::path& data,
                                                   const std::filesystem::path& scan_folder,
                                                   const std::filesystem::path& model_folder) {
  const auto scan = scanrig::ScanFolder::open(scan_folder);
  if (!scan) return scanrig::pass_on(scan);
  const auto claim = scanrig::read_claim(model_folder);
  if (!claim) return scanrig::pass_on(claim);
  return scanrig::bench::measure_dragon(data, *scan, claim->model.mesh, claim->pose1_from_pose2);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    fmt::print(stderr, "usage: bench_dragon DATA SCAN [MODEL]\n");
    return static_cast<int>(scanrig::ExitCode::usage);
  }
  const std::filesystem::path scan = argv[2];
  const auto result = run(argv[1], scan, argc == 4 ? std::filesystem::path(argv[3]) : scan / "model");
  if (!result) {
    fmt::print(stderr, "{}\n", result.error().message);
    return static_cast<int>(scanrig::exit_code(result.error().code));
  }
  fmt::print(R"({{"measured_share": {:.4f}, "median_mm": {:.4f}, "p95_mm": {:.4f}, "pose2": )", result->measured_share,
             result->median_mm, result->p95_mm);
  if (result->pose2) {
    fmt::print(R"({{"rotation_deg": {:.4f}, "translation_mm": {:.4f}}}}})", result->pose2->rotation_deg,
               result->pose2->translation_mm);
  } else {
    fmt::print("null}}");
  }
  fmt::print("\n");
  return 0;
}
